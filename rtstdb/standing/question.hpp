#pragma once
// The checked form of a standing query in double precision, and the prediction of one entity's membership as
// both move.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <string>

#include <rtstdb/result.hpp>
#include <rtstdb/standing.hpp>

#include "rtstdb/standing/relative_motion.hpp"
#include "rtstdb/standing/separation.hpp"

namespace rtstdb::standing {

struct Question {
  enum class Kind : std::uint8_t { box, sphere, frustum, ray, nearest } kind = Kind::box;
  RegionTest test = RegionTest::touching;
  StandingTarget target = StandingTarget::bounds;
  // In the carrier's frame; without a carrier, in the world frame.
  glm::dvec3 place_m{0.0};  ///< centre, eye, origin, point
  glm::dquat q{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 half_extent_m{0.0};
  double near_m = 0.0;                  ///< frustum
  double radius_m = 0.0;                ///< sphere, nearest; may be infinite for the latter
  glm::dvec3 direction{1.0, 0.0, 0.0};  ///< ray; unit
  double first_m = 0.0, last_m = 0.0;   ///< ray
  std::uint32_t k = 0;                  ///< nearest
  std::uint32_t mask = mask_all;
  EntityId carrier, excluded;

  /// Whether the query considers the entity.
  bool sees(const EntityState& state) const noexcept {
    return state.row.geometry.valid() && (state.row.mask & mask) != 0 && state.id != excluded;
  }
};

/// Check and convert a standing query; `name` is for the error. Errors: bad_input, with the values, for what
/// one-shot queries refuse, and for a region or radius that no entity can be within for any length of time.
/// The follower checks whether carrier and excluded entity exist.
Result<Question> question_of(const StandingRegion& asked, const std::string& name);
Result<Question> question_of(const StandingRay& asked, const std::string& name);
Result<Question> question_of(const StandingNearest& asked, const std::string& name);

/// Predicts the membership of one entity from the motions of the entity and of the query's carrier.
class MembershipPredictor {
 public:
  /// `box`: of the entity; a point for StandingTarget::center. `carrier`: without a carrier, the default
  /// Motion.
  MembershipPredictor(const Question& question, const Motion& carrier, const Motion& entity,
                      const EntityBox& box) noexcept;

  struct Place {
    bool inside = false;
    bool certain = false;  ///< the distance to the border exceeds the noise
  };
  Place place(std::int64_t ns) const;

  struct Next {
    enum class What : std::uint8_t { never, look_again, flip } what = What::never;
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
  auto with_gap(std::int64_t from_ns, std::int64_t to_ns, Use use) const;
  ConvexBody body(std::int64_t from_ns, std::int64_t to_ns) const;
  /// If the distance of the two origins exceeds this, the entity is outside; infinite for a ray.
  double reach_m() const noexcept;

  const Question& question_;
  EntityBox box_;
  glm::dvec3 place_m_;
  RelativeMotion motion_;
};

/// First and last time from `from_ns` on at which two origins, apart by apart_m at from_ns and separating
/// with velocity_mps, are within reach_m. first_ns = -1: never; last_ns = max_world_time_ns: they stay within
/// it.
struct Meeting {
  std::int64_t first_ns = -1, last_ns = -1;
};
Meeting meeting(const glm::dvec3& apart_m, const glm::dvec3& velocity_mps, double reach_m,
                std::int64_t from_ns) noexcept;

}  // namespace rtstdb::standing
