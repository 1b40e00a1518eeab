#include "rtstdb/oracle/posed_region.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>

#include <rtstdb/result.hpp>

#include "rtstdb/oracle/posed_ray.hpp"

namespace rtstdb::oracle {

PosedRegion posed_region(const World& world, const Region& region) {
  glm::dvec3 center_m(region.center_m);
  glm::dquat q = glm::normalize(glm::dquat(region.q));
  const glm::dvec3 half_m(region.half_extent_m);
  double noise = glm::length(half_m);
  if (region.carrier.valid()) {
    const EntityState* carrier = world.find(region.carrier);
    RTSTDB_ASSERT(carrier != nullptr, "the carrier does not exist");
    const PosedEntity at = posed(world, *carrier, region.t, false);
    noise += noise_units_m(*carrier, at.pose, at.dt_s, glm::length(center_m) + glm::length(half_m));
    center_m = at.pose.p_world_m + at.pose.q_world * center_m;
    q = at.pose.q_world * q;
  } else {
    noise += glm::length(center_m);
  }
  RTSTDB_ASSERT(std::isfinite(noise), "the region is not finite");
  RTSTDB_ASSERT(half_m.x >= 0.0 && half_m.y >= 0.0 && half_m.z >= 0.0,
                "a half extent of the region is negative");
  const glm::dmat3 axes = glm::mat3_cast(q);
  return {{center_m, {axes[0], axes[1], axes[2]}, half_m}, noise};
}

Frustum frustum_of(const Region& region, const OrientedBox& at) {
  return {.eye_m = at.center_m,
          .axis = {at.axis[0], at.axis[1], at.axis[2]},
          .near_m = static_cast<double>(region.near_m),
          .far_m = at.half_extent_m.x,
          .half_width_m = at.half_extent_m.y,
          .half_height_m = at.half_extent_m.z};
}

}  // namespace rtstdb::oracle
