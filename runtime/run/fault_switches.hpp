#pragma once
// Switches the faults of messages, devices, processes and tasks in a run.
//
// Threads: made when the run is open, after its devices and processes; the switches as FaultSwitch.

#include <memory>
#include <span>
#include <vector>

#include "runtime/injection/faults.hpp"
#include "runtime/run/module_task.hpp"
#include "runtime/run/process_watch.hpp"
#include "runtime/run/run_buses.hpp"
#include "runtime/run/wiring.hpp"

namespace hil::run {

/// The buses whose addresses the command of a process contains, by their place in the wiring.
std::vector<std::size_t> buses_in(const config::ProcessSection& process, const Wiring& wiring);

class FaultSwitches {
 public:
  /// All arguments outlive it. `tasks`: by task of the scenario.
  FaultSwitches(const Wiring& wiring, RunBuses& buses, ProcessWatch& processes,
                std::span<const std::unique_ptr<ModuleTask>> tasks);

  /// For Faults::open.
  std::span<injection::FaultSwitch* const> by_fault() const noexcept { return by_fault_; }

 private:
  std::vector<std::unique_ptr<injection::FaultSwitch>> switches_;
  std::vector<injection::FaultSwitch*> by_fault_;
};

}  // namespace hil::run
