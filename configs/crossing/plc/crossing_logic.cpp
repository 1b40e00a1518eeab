#include "configs/crossing/plc/crossing_logic.hpp"

#include "io/modbus/require.hpp"

namespace hil::crossing::plc {

namespace modbus = io::modbus;

CrossingLogic::CrossingLogic(const Timing& timing) : timing_(timing) {
  modbus::require(timing.minimum_green_ms >= 0 && timing.maximum_green_ms >= timing.minimum_green_ms &&
                      timing.yellow_ms >= 0 && timing.all_red_ms >= 0 && timing.red_yellow_ms >= 0 &&
                      timing.watchdog_ms >= 0,
                  "CrossingLogic: a time is negative, or maximum green is below minimum green");
  set_outputs();
}

const Outputs& CrossingLogic::step(const Inputs& inputs, std::int64_t elapsed_ms) {
  modbus::require(elapsed_ms >= 0, "CrossingLogic::step: time goes backwards");
  in_stage_ms_ += elapsed_ms;
  check_heartbeat(inputs, elapsed_ms);
  update_demand(inputs);
  advance(target_of(inputs));
  set_outputs();
  modbus::require(outputs_.ego == Light::red || outputs_.cross == Light::red,
                  "CrossingLogic: no light is red");
  return outputs_;
}

void CrossingLogic::check_heartbeat(const Inputs& inputs, std::int64_t elapsed_ms) {
  const bool changed = heartbeat_known_ && inputs.heartbeat != last_heartbeat_;
  heartbeat_known_ = true;
  last_heartbeat_ = inputs.heartbeat;
  if (changed) {
    watchdog_armed_ = true;
    since_heartbeat_ms_ = 0;
  } else {
    since_heartbeat_ms_ += elapsed_ms;
  }
  watchdog_fault_ = watchdog_armed_ && since_heartbeat_ms_ >= timing_.watchdog_ms;
}

void CrossingLogic::update_demand(const Inputs& inputs) {
  if (inputs.detector_ego > 0) demand_ego_ = true;
  if (inputs.detector_cross_right > 0 || inputs.detector_cross_left > 0) demand_cross_ = true;
  if (stage_ == Stage::green) (road_ == Road::ego ? demand_ego_ : demand_cross_) = false;
}

CrossingLogic::Target CrossingLogic::target_of(const Inputs& inputs) const {
  if (watchdog_fault_) return Target::none;
  switch (static_cast<Override>(inputs.override_mode)) {
    case Override::ego_green:
      return Target::ego;
    case Override::cross_green:
      return Target::cross;
    case Override::all_red:
      return Target::none;
    case Override::automatic:
      break;
  }
  return automatic_target(inputs);
}

CrossingLogic::Target CrossingLogic::automatic_target(const Inputs& inputs) const {
  const bool ego = road_ == Road::ego;
  const Target same = ego ? Target::ego : Target::cross;
  const Target other = ego ? Target::cross : Target::ego;
  if (!(ego ? demand_cross_ : demand_ego_)) return same;
  if (stage_ != Stage::green) return stage_ == Stage::red_yellow ? same : other;
  const bool occupied =
      ego ? inputs.detector_ego > 0 : inputs.detector_cross_right > 0 || inputs.detector_cross_left > 0;
  return occupied && in_stage_ms_ < timing_.maximum_green_ms ? same : other;
}

void CrossingLogic::advance(Target target) {
  const Target current = road_ == Road::ego ? Target::ego : Target::cross;
  switch (stage_) {
    case Stage::green:
      if (target != current && (watchdog_fault_ || in_stage_ms_ >= timing_.minimum_green_ms))
        enter(Stage::yellow);
      break;
    case Stage::yellow:
      if (in_stage_ms_ >= timing_.yellow_ms) enter(Stage::all_red);
      break;
    case Stage::all_red:
      if (target != Target::none && in_stage_ms_ >= timing_.all_red_ms) {
        road_ = target == Target::ego ? Road::ego : Road::cross;
        enter(Stage::red_yellow);
      }
      break;
    case Stage::red_yellow:
      // No vehicle has started: red follows without yellow.
      if (target == Target::none) {
        enter(Stage::all_red);
      } else if (in_stage_ms_ >= timing_.red_yellow_ms) {
        enter(Stage::green);
      }
      break;
  }
}

void CrossingLogic::enter(Stage stage) {
  stage_ = stage;
  in_stage_ms_ = 0;
}

void CrossingLogic::set_outputs() {
  Light light = Light::red;
  if (stage_ == Stage::green) light = Light::green;
  if (stage_ == Stage::yellow) light = Light::yellow;
  if (stage_ == Stage::red_yellow) light = Light::red_yellow;
  outputs_.ego = road_ == Road::ego ? light : Light::red;
  outputs_.cross = road_ == Road::cross ? light : Light::red;
  outputs_.demand_ego = demand_ego_;
  outputs_.demand_cross = demand_cross_;
  outputs_.watchdog_fault = watchdog_fault_;
  outputs_.green_remaining_ms = stage_ == Stage::green ? timing_.minimum_green_ms - in_stage_ms_ : 0;
}

}  // namespace hil::crossing::plc
