#include "rtstdb/oracle/posed_point.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <numbers>

#include <rtstdb/result.hpp>

#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {

PosedPoint::PosedPoint(const World& world, const Nearest& point) : point_m(point.point_m) {
  if (point.carrier.valid()) {
    const EntityState* carrier = world.find(point.carrier);
    RTSTDB_ASSERT(carrier != nullptr, "the carrier does not exist");
    const PosedEntity at = posed(world, *carrier, point.t, false);
    const Motion& motion = carrier->row.motion;
    const glm::dvec3 arm_m = at.pose.q_world * point_m;
    point_m = at.pose.p_world_m + arm_m;
    v_mps = motion.v_world_mps + glm::cross(motion.w_world_radps, arm_m);
    noise_units_m = oracle::noise_units_m(*carrier, at.pose, at.dt_s, glm::length(arm_m));
  } else {
    noise_units_m = glm::length(point_m);
  }
  RTSTDB_ASSERT(std::isfinite(noise_units_m), "the point is not finite");
  RTSTDB_ASSERT(point.radius_m >= 0.0f, "the radius is negative");
}

double PosedPoint::noise_m(const PosedEntity& entity) const noexcept {
  return noise_per_unit *
         (noise_units_m + oracle::noise_units_m(*entity.state, entity.pose, entity.dt_s, entity.reach()));
}

bool looked_at(const EntityState& state, const Nearest& point) noexcept {
  return visible(state, point.mask) && state.id != point.excluded;
}

Measured measured_to(const PosedEntity& entity, NearestTarget target, const glm::dvec3& point_m) noexcept {
  const OrientedBox box = oriented_box(entity.mesh->bounds(), entity.state->row.scale, entity.pose);
  Measured measured;
  measured.p_world_m = target == NearestTarget::center ? box.center_m : nearest_in_box(box, point_m);
  measured.distance_m = glm::length(measured.p_world_m - point_m);
  return measured;
}

Measured measured_to_triangle(const PosedEntity& entity, std::uint32_t triangle,
                              const glm::dvec3& point_m) noexcept {
  const glm::dvec3 local_m = in_frame_of(entity, point_m);
  std::array<glm::dvec3, 3> corners = entity.mesh->corners(triangle);
  for (glm::dvec3& corner : corners)
    corner *= entity.state->row.scale;
  const TrianglePoint nearest = nearest_on_triangle(corners, local_m);
  return {triangle, glm::length(nearest.point - local_m), nearest.u, nearest.v,
          entity.pose.p_world_m + entity.pose.q_world * nearest.point};
}

glm::dvec3 in_frame_of(const PosedEntity& entity, const glm::dvec3& point_m) noexcept {
  return glm::conjugate(entity.pose.q_world) * (point_m - entity.pose.p_world_m);
}

bool winds_around(const PosedEntity& entity, const glm::dvec3& point_m) noexcept {
  // Scaling changes angles, but not the winding number of a surface around a point.
  const glm::dvec3 p = in_frame_of(entity, point_m) / entity.state->row.scale;
  const Bounds& bounds = entity.mesh->bounds();
  if (p != glm::clamp(p, glm::dvec3(bounds.minimum_m), glm::dvec3(bounds.maximum_m))) return false;
  double half_angles = 0.0;
  for (std::uint32_t i = 0; i < entity.mesh->triangle_count(); ++i) {
    auto [a, b, c] = entity.mesh->corners(i);
    a -= p;
    b -= p;
    c -= p;
    const double la = glm::length(a);
    const double lb = glm::length(b);
    const double lc = glm::length(c);
    half_angles += std::atan2(glm::dot(a, glm::cross(b, c)),
                              la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return std::abs(half_angles / (2.0 * std::numbers::pi)) > 0.5;
}

glm::dvec3 relative_velocity(const PosedEntity& entity, const PosedPoint& point,
                             const glm::dvec3& p_world_m) noexcept {
  const Motion& motion = entity.state->row.motion;
  return motion.v_world_mps + glm::cross(motion.w_world_radps, p_world_m - entity.pose.p_world_m) -
         point.v_mps;
}

}  // namespace rtstdb::oracle
