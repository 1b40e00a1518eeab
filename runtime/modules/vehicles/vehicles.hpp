#pragma once
// Road vehicles on straight lanes: each follows its driver (driver.hpp), keeps its distance to the vehicle
// ahead on its lane, and stops at its stop line while its light is not green, unless it runs the light. One
// of them may be braked from outside (the device under test): its own driver goes on, and the harder of both
// decelerations counts.
//
// Inputs   light_<group>  state of a traffic light: 0 red, 1 red-yellow, 2 green, 3 yellow
//          <vehicle>_brake_request  m/s2, at least 0; for vehicles with `braked_from_outside`
// Outputs  <vehicle>.x, .y (centre, m), .speed (m/s), .acceleration (m/s2), .yaw_rate (rad/s)
//
// A vehicle's row in the world is written only when its motion changes: between two writes it is a function
// of time.

#include "runtime/modules/module.hpp"

namespace hil::modules {

ModuleType vehicles_type();

}  // namespace hil::modules
