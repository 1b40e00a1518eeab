#pragma once
// The kinds of fault of a process and of a task (faults/table.def), and the ports between a run and a kind.
//
// Threads: kinds on any; make_switch on the thread that opens the run; set on the base thread, where it
// neither allocates nor blocks.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "runtime/config/fault_section.hpp"
#include "runtime/injection/faults.hpp"
#include "runtime/run/module_task.hpp"
#include "runtime/run/process_watch.hpp"

namespace hil::run {

/// What the faults of processes derive their effects from.
class ProcessFault : public config::FaultEffect {
 public:
  /// Begins or ends the fault of this name, which outlives the watch. `process`: its place in the list of
  /// programs.
  virtual void set(ProcessWatch& processes, std::size_t process, const std::string& name,
                   bool active) const noexcept = 0;
};

/// What the faults of tasks derive their effects from.
class TaskFault : public config::FaultEffect {
 public:
  /// Begins and ends the fault in a run. `period_ns`: of the task, which outlives the switch.
  virtual std::unique_ptr<injection::FaultSwitch> make_switch(ModuleTask& task,
                                                              std::int64_t period_ns) const = 0;
  /// How long after its end it may still be why a tick is missing.
  virtual std::int64_t aftermath_ns() const noexcept = 0;
};

/// Those of signals, processes and tasks, for config::load_scenario.
std::vector<config::FaultKind> fault_kinds();

}  // namespace hil::run
