#pragma once
// The checked form of a standing query, in double precision.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <string>

#include <rtstdb/result.hpp>
#include <rtstdb/standing.hpp>

namespace rtstdb::standing {

struct QuerySpec {
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
  bool considers(const EntityState& state) const noexcept {
    return state.row.geometry.valid() && (state.row.mask & mask) != 0 && state.id != excluded;
  }
};

/// Check and convert a standing query; `name` is for the error. Errors: bad_input, with the values, for what
/// one-shot queries refuse, and for a region or radius that no entity can be within for any length of time.
/// The follower checks whether carrier and excluded entity exist.
Result<QuerySpec> make_query_spec(const StandingRegion& query, const std::string& name);
Result<QuerySpec> make_query_spec(const StandingRay& query, const std::string& name);
Result<QuerySpec> make_query_spec(const StandingNearest& query, const std::string& name);

}  // namespace rtstdb::standing
