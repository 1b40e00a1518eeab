#pragma once
// The inputs and outputs of each body of the rigid_bodies module that moves.
//
// Threads: body_inputs and body_outputs while configuring; the others are pure functions.

#include <span>
#include <string>
#include <vector>

#include <hil/world/world_module.hpp>

#include "runtime/modules/rigid_bodies/body_set.hpp"

namespace hil::modules {

inline constexpr std::size_t inputs_per_body = 7;
inline constexpr std::size_t outputs_per_body = 13;

/// force_x, force_y, force_z, torque_x, torque_y, torque_z, hold
std::vector<Port> body_inputs(const std::string& body);
/// x, y, z, vx, vy, vz, qw, qx, qy, qz, wx, wy, wz
std::vector<Port> body_outputs(const std::string& body);

struct BodyInputs {
  Wrench wrench{};
  bool hold = false;
};
/// Inputs that are not fresh, or not finite, count as 0.
BodyInputs read_body_inputs(std::span<const signals::SignalValue> inputs) noexcept;
void write_body_outputs(const BodySet::Body& body, std::span<double> outputs) noexcept;

}  // namespace hil::modules
