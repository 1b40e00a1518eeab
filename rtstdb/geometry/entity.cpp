#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>

#include <rtstdb/entity.hpp>

namespace rtstdb {
namespace {

/// sin(half_angle) / angle, whose limit at zero is 1/2.
double half_sinc(double half_angle) noexcept {
  // Below this the next term of the series is under one part in 2^53.
  constexpr double series_below = 1e-4;
  if (std::abs(half_angle) < series_below) return 0.5 - half_angle * half_angle / 12.0;
  return 0.5 * std::sin(half_angle) / half_angle;
}

/// The rotation by |w| dt about w: the exponential map, exact for a constant angular velocity.
glm::dquat rotation_of(const glm::dvec3& w_radps, double dt_s) noexcept {
  const glm::dvec3 turn_rad = w_radps * dt_s;
  const double half_angle = 0.5 * glm::length(turn_rad);
  const glm::dvec3 axis_part = turn_rad * half_sinc(half_angle);
  return {std::cos(half_angle), axis_part.x, axis_part.y, axis_part.z};
}

}  // namespace

Pose pose_at(const Motion& motion, WorldTime t) noexcept {
  const double dt_s = seconds_between(motion.valid_from, t);
  return {motion.p_world_m + motion.v_world_mps * dt_s,
          glm::normalize(rotation_of(motion.w_world_radps, dt_s) * motion.q_world)};
}

Motion rebased(const Motion& motion, WorldTime t) noexcept {
  const Pose pose = pose_at(motion, t);
  return {pose.p_world_m, pose.q_world, motion.v_world_mps, motion.w_world_radps, t};
}

}  // namespace rtstdb
