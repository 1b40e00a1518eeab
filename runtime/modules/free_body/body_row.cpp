#include "runtime/modules/free_body/body_row.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>

namespace hil::modules {

RowError error_of(const rtstdb::Motion& row, const RigidBodyState& state, rtstdb::WorldTime t) noexcept {
  const rtstdb::Pose pose = rtstdb::pose_at(row, t);
  const glm::dquat turn = glm::conjugate(pose.q_world) * state.q_world;
  const double half_sine = glm::length(glm::dvec3(turn.x, turn.y, turn.z));
  return {.position_m = glm::length(state.p_world_m - pose.p_world_m),
          .angle_rad = 2.0 * std::atan2(half_sine, std::abs(turn.w))};
}

std::optional<rtstdb::Motion> BodyRow::replacement(const RigidBody& body, const BodyStep& step) noexcept {
  if (written_) {
    const RowError at_begin = error_of(*written_, step.begin, step.begin_time);
    largest_.position_m = std::max(largest_.position_m, at_begin.position_m);
    largest_.angle_rad = std::max(largest_.angle_rad, at_begin.angle_rad);
    if (is_permitted(at_begin) && holds_at_end(step)) return std::nullopt;
  }
  return rtstdb::Motion{
      .p_world_m = step.begin.p_world_m,
      .q_world = step.begin.q_world,
      .v_world_mps = 0.5 * (step.begin.v_world_mps + step.end.v_world_mps),
      .w_world_radps = 0.5 * (body.w_world_radps(step.begin) + body.w_world_radps(step.end)),
      .valid_from = step.begin_time};
}

bool BodyRow::holds_at_end(const BodyStep& step) const noexcept {
  return written_ && is_permitted(error_of(*written_, step.end, step.end_time));
}

}  // namespace hil::modules
