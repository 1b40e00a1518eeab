#pragma once
// What a standing query asks, checked and in double precision; and how one entity stands to it as both move.

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
  // In the carrier's frame, or the world's.
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

  bool sees(const EntityState& state) const noexcept {
    return state.row.geometry.valid() && (state.row.mask & mask) != 0 && state.id != excluded;
  }
};

/// Refuse, as bad_input with the values: what one-shot queries refuse, and what can hold nobody for any time. Whether carrier and
/// excluded live is the follower's question.
Result<Question> question_of(const StandingRegion& asked, const std::string& name);
Result<Question> question_of(const StandingRay& asked, const std::string& name);
Result<Question> question_of(const StandingNearest& asked, const std::string& name);

/// One entity and the question, as they move from some version on.
class MembershipPredictor {
 public:
  /// `box`: of the entity; a point where its centre counts. No carrier: a motion that stands at the world's origin.
  MembershipPredictor(const Question& question, const Motion& carrier, const Motion& entity,
                      const EntityBox& box) noexcept;

  struct Place {
    bool inside = false;
    bool certain = false;  ///< the border is farther than the noise
  };
  Place place(std::int64_t ns) const;

  struct Next {
    enum class What : std::uint8_t { never, look_again, flip } what = What::never;
    std::int64_t ns = 0;
  };
  /// What comes first after from_ns for one that is a member then, or none: its flip; or when to look again, nothing being there
  /// before, which is about look_ahead_ns later.
  Next next(std::int64_t from_ns, std::int64_t look_ahead_ns, bool member) const;

  const RelativeMotion& motion() const noexcept { return motion_; }
  const EntityBox& box() const noexcept { return box_; }
  /// Of the question, in the frame from which `motion` is seen.
  const glm::dvec3& place_m() const noexcept { return place_m_; }

 private:
  template <class Use>
  auto with_gap(std::int64_t from_ns, std::int64_t to_ns, Use use) const;
  ConvexBody body(std::int64_t from_ns, std::int64_t to_ns) const;
  /// Beyond this distance of the origins nobody is inside; infinite for a ray.
  double reach_m() const noexcept;

  const Question& question_;
  EntityBox box_;
  glm::dvec3 place_m_;
  RelativeMotion motion_;
};

/// The first time from `from_ns` on at which two origins that are apart by apart_m then and part with velocity_mps are within reach_m;
/// -1: never. And the last; max: they stay.
struct Meeting {
  std::int64_t first_ns = -1, last_ns = -1;
};
Meeting meeting(const glm::dvec3& apart_m, const glm::dvec3& velocity_mps, double reach_m,
                std::int64_t from_ns) noexcept;

}  // namespace rtstdb::standing
