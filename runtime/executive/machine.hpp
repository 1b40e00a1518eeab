#pragma once
// What this machine is, as far as keeping time goes. Ordinary threads only.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hil::executive {

struct MachineFacts {
  bool preempt_rt = false;
  std::int64_t timer_resolution_ns = 0;
  std::vector<std::string>
      frequency_governors;  ///< each once, of all CPUs; empty: the CPUs keep one frequency
  /// Of each rt_period_us, how much real-time threads may use in all; negative: no limit; absent: not to be
  /// read.
  std::optional<std::int64_t> rt_runtime_us;
  std::int64_t rt_period_us = 0;
};

/// `root` is where /proc and /sys are found: "" on a machine, a folder in tests.
MachineFacts read_machine_facts(const std::string& root = "");

/// One sentence for each fact that spoils timing. `fifo`: whether SCHED_FIFO was asked for.
std::vector<std::string> timing_limits(const MachineFacts& facts, bool fifo);

}  // namespace hil::executive
