#pragma once
// The programs of a run that connect to one virtual CAN bus. The run begins when all of them have
// connected, as an ECU is powered before a test begins.
//
// Threads: the one that opens the run.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/virtual/hub.hpp"
#include "runtime/buses/bus.hpp"
#include "runtime/buses/can/can_section.hpp"
#include "runtime/config/scenario.hpp"

namespace hil::buses::can {

class ConnectedPrograms {
 public:
  /// The enabled programs whose command has the address of `bus`. The scenario outlives it.
  ConnectedPrograms(const config::Scenario& scenario, const CanSection& bus);

  /// The number of connections that the programs make together.
  std::size_t connection_count() const noexcept;

  /// Whether all programs have connected to the hub. A connection belongs to a program by its process group,
  /// so that a script may start the program that connects; a connection of no program's group may be any
  /// program's until the longest start_timeout has passed. Throws io::DeviceError when a program has not
  /// connected within its start_timeout.
  bool all_connected(io::virtual_bus::Hub& hub, const StartedPrograms& started) const;

 private:
  struct Program {
    const config::ProcessSection* process = nullptr;
    std::size_t connections = 0;
  };
  const CanSection& bus_;
  const bool lockstep_;
  std::vector<Program> programs_;
};

}  // namespace hil::buses::can
