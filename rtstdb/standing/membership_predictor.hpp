#pragma once
// The prediction of one entity's membership in a standing query, as the entity and the query move.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>

#include "rtstdb/standing/query_spec.hpp"
#include "rtstdb/standing/relative_motion.hpp"
#include "rtstdb/standing/separation.hpp"

namespace rtstdb::standing {

/// Predicts the membership of one entity from the motions of the entity and of the query's carrier.
class MembershipPredictor {
 public:
  /// `box`: of the entity; a point for StandingTarget::center. `carrier`: without a carrier, the default
  /// Motion.
  MembershipPredictor(const QuerySpec& spec, const Motion& carrier, const Motion& entity,
                      const EntityBox& box) noexcept;

  struct Membership {
    bool inside = false;
    bool certain = false;  ///< the distance to the border exceeds the noise
  };
  Membership membership_at(std::int64_t ns) const;

  struct Next {
    enum class What : std::uint8_t { never, search_again, crossing } what = What::never;
    std::int64_t ns = 0;
  };
  /// The next event after from_ns for an entity that is (not) a member then: its flip, or the instant at
  /// which to search again, about look_ahead_ns later, with no flip before; or never.
  Next next(std::int64_t from_ns, std::int64_t look_ahead_ns, bool member) const;

  const RelativeMotion& motion() const noexcept { return motion_; }
  const EntityBox& box() const noexcept { return box_; }
  /// Place of the query in the frame to which `motion` is relative.
  const glm::dvec3& place_m() const noexcept { return place_m_; }

 private:
  template <class Use>
  auto with_border_function(std::int64_t from_ns, std::int64_t to_ns, Use use) const;
  ConvexBody body(std::int64_t from_ns, std::int64_t to_ns) const;
  /// If the distance of the two origins exceeds this, the entity is outside; infinite for a ray.
  double reach_m() const noexcept;

  const QuerySpec& spec_;
  EntityBox box_;
  glm::dvec3 place_m_;
  RelativeMotion motion_;
};

/// First and last time from `from_ns` on at which two origins, apart by apart_m at from_ns and separating
/// with velocity_mps, are within reach_m. first_ns = -1: never; last_ns = max_world_time_ns: they stay within
/// it.
struct ReachInterval {
  std::int64_t first_ns = -1, last_ns = -1;
};
ReachInterval reach_interval(const glm::dvec3& apart_m, const glm::dvec3& velocity_mps, double reach_m,
                             std::int64_t from_ns) noexcept;

}  // namespace rtstdb::standing
