#pragma once
// Faults of a CAN device, as a scenario has them.

#include <cstdint>
#include <memory>
#include <string>

#include "io/can/can_device.hpp"
#include "runtime/buses/can/can_fault.hpp"
#include "runtime/config/parse.hpp"

namespace hil::tests {

/// The effect of an entry of `faults`: "drop: 25 %". Null with mistakes, which `problem` then has. `message`:
/// empty: it is a fault of the bus.
inline std::shared_ptr<const buses::can::CanFault> can_fault(const std::string& message,
                                                             const std::string& entry, std::string& problem) {
  const std::string key = entry.substr(0, entry.find(':'));
  const auto target = message.empty() ? config::FaultTarget::device : config::FaultTarget::message;
  for (const config::FaultKind& kind : buses::can::can_fault_kinds()) {
    if (kind.target != target || kind.key != key || !entry.ends_with(kind.word)) continue;
    config::Diagnostics diagnostics;
    const config::Schema schema = kind.schema == nullptr ? config::Schema::text() : kind.schema();
    const auto section =
        config::parse_text("fault", "{" + entry + "}",
                           config::Schema::record({config::Field::needed(key, schema, "")}), diagnostics);
    std::shared_ptr<const config::FaultEffect> effect;
    if (section) {
      const config::ActivationSection activation{};
      effect =
          kind.read((*section)[key], {.period_ns = 0, .activation = activation, .diagnostics = diagnostics});
    }
    problem = diagnostics.to_text();
    if (!problem.empty()) return nullptr;
    return std::dynamic_pointer_cast<const buses::can::CanFault>(effect);
  }
  problem = "there is no such kind";
  return nullptr;
}

/// Why the device can not have the fault; empty: it can.
inline std::string can_fault_problem(const io::can::CanDevice& device, const std::string& message,
                                     const std::string& entry) {
  std::string problem;
  const auto fault = can_fault(message, entry, problem);
  return fault == nullptr ? problem : fault->problem(device, message);
}

/// Adds the fault to the device, unless that can not have it. Returns why; empty: it can.
inline std::string add_can_fault(io::can::CanDevice& device, const std::string& message,
                                 const std::string& entry, std::uint64_t seed = 0) {
  std::string problem = can_fault_problem(device, message, entry);
  if (problem.empty()) can_fault(message, entry, problem)->add_to(device, message, seed);
  return problem;
}

}  // namespace hil::tests
