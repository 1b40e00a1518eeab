#pragma once
// Figures of the executive: the wake-up latency of its base thread, alternating with cyclictest, and the cost
// of a tick.

#include <cstdint>
#include <string>
#include <vector>

#include "bench/executive/cyclictest.hpp"

namespace hil::bench {

struct WakeupComparison {
  WakeupLatency ours;  ///< medians over the rounds; `samples` counts all rounds
  WakeupLatency theirs;
  bool fifo = false;  ///< both under SCHED_FIFO; else both under the ordinary scheduler
  std::vector<std::string> degraded;
};

struct ComparisonOptions {
  int rounds = 5;
  std::uint64_t ticks_per_round = 4'000;
  int priority = 60;
};

/// Runs an executive of 1 kHz without tasks and cyclictest at 1 kHz in alternation; the order alternates too.
/// Throws std::runtime_error when cyclictest can not run.
WakeupComparison compare_wakeup(const ComparisonOptions& options);

struct TickOverhead {
  double median_us = 0.0;  ///< from the wake-up to the end of the tick
  std::uint64_t samples = 0;
};

/// The executive's own time for a tick with ten empty tasks on the base thread, including accounting.
TickOverhead measure_tick_overhead(const ComparisonOptions& options);

}  // namespace hil::bench
