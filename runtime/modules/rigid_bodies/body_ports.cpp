#include "runtime/modules/rigid_bodies/body_ports.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hil::modules {

std::vector<Port> body_inputs(const std::string& body) {
  std::vector<Port> ports;
  for (const char* axis : {"x", "y", "z"}) {
    ports.push_back({.name = body + "_force_" + axis,
                     .unit = "N",
                     .about = std::string("Force along the body's ") + axis});
  }
  for (const char* axis : {"x", "y", "z"}) {
    ports.push_back({.name = body + "_torque_" + axis,
                     .unit = "N m",
                     .about = std::string("Torque about the body's ") + axis});
  }
  ports.push_back({.name = body + "_hold", .unit = "", .about = "Not 0: the body is held where it is"});
  return ports;
}

std::vector<Port> body_outputs(const std::string& body) {
  std::vector<Port> ports;
  for (const char* axis : {"x", "y", "z"}) {
    ports.push_back({.name = body + "." + axis, .unit = "m", .about = "Origin of the body in the world"});
  }
  for (const char* axis : {"vx", "vy", "vz"}) {
    ports.push_back(
        {.name = body + "." + axis, .unit = "m/s", .about = "Velocity of the origin in the world"});
  }
  for (const char* part : {"qw", "qx", "qy", "qz"}) {
    ports.push_back({.name = body + "." + part,
                     .unit = "",
                     .about = "Attitude: body frame to world frame",
                     .initial = part[1] == 'w' ? 1.0 : 0.0});
  }
  for (const char* axis : {"wx", "wy", "wz"}) {
    ports.push_back({.name = body + "." + axis,
                     .unit = "rad/s",
                     .about = "Angular rate against an inertial frame, along the body's axes"});
  }
  return ports;
}

BodyInputs read_body_inputs(std::span<const signals::SignalValue> inputs) noexcept {
  const auto value = [&](std::size_t i) {
    return inputs[i].fresh && std::isfinite(inputs[i].value) ? inputs[i].value : 0.0;
  };
  return {.wrench = {.force_body_n = {value(0), value(1), value(2)},
                     .torque_body_nm = {value(3), value(4), value(5)}},
          .hold = value(6) != 0.0};
}

void write_body_outputs(const BodySet::Body& body, std::span<double> outputs) noexcept {
  const glm::dvec3& p = body.state.p_world_m;
  const glm::dvec3& v = body.state.v_world_mps;
  const glm::dquat& q = body.state.q_world;
  const glm::dvec3 w = body.rigid_body->w_body_radps(body.state);
  const std::array<double, outputs_per_body> values{p.x, p.y, p.z, v.x, v.y, v.z, q.w,
                                                    q.x, q.y, q.z, w.x, w.y, w.z};
  std::copy(values.begin(), values.end(), outputs.begin());
}

}  // namespace hil::modules
