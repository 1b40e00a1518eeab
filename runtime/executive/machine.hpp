#pragma once
// Properties of this machine that affect timing. Ordinary threads only.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hil::executive {

struct MachineState {
  bool preempt_rt = false;
  std::int64_t timer_resolution_ns = 0;
  std::vector<std::string>
      frequency_governors;  ///< of all CPUs, each governor once; empty: no frequency scaling
  /// Time that all real-time threads together may use per rt_period_us; negative: no limit; absent: not
  /// readable.
  std::optional<std::int64_t> rt_runtime_us;
  std::int64_t rt_period_us = 0;
};

/// `root` is the folder that contains /proc and /sys: "" on a machine, another folder in tests.
MachineState read_machine_state(const std::string& root = "");

/// One sentence for each property that impairs timing. `fifo`: SCHED_FIFO was requested.
std::vector<std::string> timing_limits(const MachineState& facts, bool fifo);

}  // namespace hil::executive
