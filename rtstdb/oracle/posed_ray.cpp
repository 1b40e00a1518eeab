#include "rtstdb/oracle/posed_ray.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>

#include <rtstdb/result.hpp>

namespace rtstdb::oracle {

std::array<glm::dvec3, 3> PosedEntity::corners_world(std::uint32_t triangle) const noexcept {
  std::array<glm::dvec3, 3> corners = mesh->corners(triangle);
  for (glm::dvec3& corner : corners)
    corner = pose.p_world_m + pose.q_world * (state->row.scale * corner);
  return corners;
}

bool visible(const EntityState& state, std::uint32_t mask) noexcept {
  return state.row.geometry.valid() && (state.row.mask & mask) != 0;
}

/// The instant at which the row is stored in single precision: the last whole second, or the begin of its
/// motion if later.
double since_written_down_s(const Motion& motion, WorldTime t) noexcept {
  constexpr std::int64_t second_ns = 1'000'000'000;
  const std::int64_t rest_ns = t.time_since_epoch().count() % second_ns;
  const WorldTime second = t - Nanoseconds(rest_ns < 0 ? rest_ns + second_ns : rest_ns);
  const bool began_since = motion.valid_from > second && seconds_between(second, motion.valid_from) < 1.0;
  return seconds_between(began_since ? motion.valid_from : second, t);
}

PosedEntity posed(const World& world, const EntityState& state, WorldTime t, bool ignore_motion) noexcept {
  const WorldTime instant = ignore_motion ? world.version_time() : t;
  const MeshTree* mesh = state.row.geometry.valid() ? &world.mesh_of(state) : nullptr;
  return {&state, mesh, pose_at(state.row.motion, instant), since_written_down_s(state.row.motion, instant)};
}

double noise_units_m(const EntityState& state, const Pose& pose, double dt_s, double arm_m) noexcept {
  const Motion& motion = state.row.motion;
  const double dt = std::abs(dt_s);
  return glm::length(pose.p_world_m) + glm::length(motion.v_world_mps) * dt +
         arm_m * (1.0 + glm::length(motion.w_world_radps) * dt);
}

PosedRay::PosedRay(const World& world, const Ray& ray, bool ignore_motion)
    : origin_m(ray.origin_m),
      direction(ray.direction),
      lambda_min(static_cast<double>(ray.lambda_min)),
      lambda_max(static_cast<double>(ray.lambda_max)) {
  if (ray.carrier.valid()) {
    const EntityState* carrier = world.find(ray.carrier);
    RTSTDB_ASSERT(carrier != nullptr, "the carrier does not exist");
    const PosedEntity at = posed(world, *carrier, ray.t, ignore_motion);
    const Motion& motion = carrier->row.motion;
    const glm::dvec3 arm_m = at.pose.q_world * origin_m;
    origin_m = at.pose.p_world_m + arm_m;
    direction = at.pose.q_world * direction;
    v_origin_mps = motion.v_world_mps + glm::cross(motion.w_world_radps, arm_m);
    noise_units_m = oracle::noise_units_m(*carrier, at.pose, at.dt_s, glm::length(arm_m));
    noise_units_per_m += glm::length(motion.w_world_radps) * std::abs(at.dt_s);
  } else {
    noise_units_m = glm::length(origin_m);
  }
  length = glm::length(direction);
  RTSTDB_ASSERT(std::isfinite(length) && length > 0.0 && std::isfinite(noise_units_m),
                "the ray is not finite, or its direction is zero");
  RTSTDB_ASSERT(lambda_min <= lambda_max, "lambda_min is above lambda_max");
}

LocalRay PosedRay::in_frame_of(const PosedEntity& entity) const noexcept {
  const glm::dquat to_entity = glm::conjugate(entity.pose.q_world);
  const glm::dvec3& scale = entity.state->row.scale;
  return {(to_entity * (origin_m - entity.pose.p_world_m)) / scale, (to_entity * direction) / scale,
          lambda_min, lambda_max};
}

bool PosedRay::passes(const PosedEntity& entity, double margin_m) const noexcept {
  const glm::dvec3 to_center = entity.pose.p_world_m - origin_m;
  const double off_line_m = glm::length(glm::cross(to_center, direction)) / length;
  const double rounding_m = 1e-12 * (glm::length(to_center) + glm::length(origin_m));
  return off_line_m <= entity.reach() + margin_m + rounding_m;
}

double PosedRay::noise_m(const PosedEntity& entity, double lambda, double arm_m) const noexcept {
  const double along_m = std::abs(lambda) * length;
  return noise_per_unit * (noise_units_m + along_m * noise_units_per_m +
                           oracle::noise_units_m(*entity.state, entity.pose, entity.dt_s, arm_m));
}

}  // namespace rtstdb::oracle
