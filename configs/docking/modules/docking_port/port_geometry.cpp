#include "configs/docking/modules/docking_port/port_geometry.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>

namespace hil::modules {
namespace {

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

RelativePort relative_port(const rtstdb::Motion& chaser, const BodyPort& chaser_port,
                           const rtstdb::Motion& target, const BodyPort& target_port,
                           rtstdb::WorldTime t) noexcept {
  const rtstdb::Pose at_chaser = rtstdb::pose_at(chaser, t);
  const rtstdb::Pose at_target = rtstdb::pose_at(target, t);
  const glm::dvec3 chaser_arm = at_chaser.q_world * chaser_port.point_m;
  const glm::dvec3 axis = at_target.q_world * target_port.axis;
  const glm::dvec3 chaser_point = at_chaser.p_world_m + chaser_arm;
  const glm::dvec3 between = chaser_point - (at_target.p_world_m + at_target.q_world * target_port.point_m);
  // The velocity of the chaser's port relative to the point of the target's body at the same place.
  const glm::dvec3 velocity = chaser.v_world_mps + glm::cross(chaser.w_world_radps, chaser_arm) -
                              target.v_world_mps -
                              glm::cross(target.w_world_radps, chaser_point - at_target.p_world_m);
  RelativePort relative;
  relative.distance_m = glm::dot(between, axis);
  relative.lateral_m = glm::length(between - relative.distance_m * axis);
  relative.off_axis_rad = std::atan2(relative.lateral_m, relative.distance_m);
  relative.misalignment_rad = angle_between(at_chaser.q_world * chaser_port.axis, -axis);
  relative.closing_speed_mps = -glm::dot(velocity, axis);
  relative.lateral_speed_mps = glm::length(velocity + relative.closing_speed_mps * axis);
  return relative;
}

}  // namespace hil::modules
