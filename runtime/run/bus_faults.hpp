#pragma once
// The faults of messages and devices of a scenario, as faults of its buses.
//
// Threads: the one that wires the run.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>

#include "runtime/buses/bus.hpp"
#include "runtime/config/scenario.hpp"

namespace hil::run {

struct BusFault {
  std::size_t fault = 0;   ///< its place in the scenario's list
  std::size_t bus = 0;     ///< in the list of wired buses
  std::size_t number = 0;  ///< of the faults of this bus (io::FaultTarget)
  buses::InjectedFault injected{};
};

/// A bus that faults can act on.
struct FaultyBus {
  std::string full_name;  ///< "can.car"
  const buses::BusWiring* wiring = nullptr;
};

/// A mistake for each fault that its bus can not have.
std::vector<BusFault> bus_faults(const config::Scenario& scenario, std::span<const FaultyBus> buses,
                                 config::Diagnostics& diagnostics);

/// A mistake for each fault of a process or task that does not exist.
void check_fault_targets(const config::Scenario& scenario, config::Diagnostics& diagnostics);

}  // namespace hil::run
