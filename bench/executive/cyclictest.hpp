#pragma once
// Runs the installed cyclictest (package rt-tests), the reference for wake-up latency: a thread sleeps until
// absolute times and records how late it wakes.

#include <cstdint>
#include <string>

namespace hil::bench {

struct WakeupLatency {
  double p50_us = 0.0;
  double p99_us = 0.0;
  std::uint64_t samples = 0;
  // Set by cyclictest only.
  double max_us = 0.0;
  std::uint64_t beyond_1_ms = 0;  ///< samples
};

struct CyclictestOptions {
  std::uint64_t ticks = 1'000;
  std::int64_t period_us = 1'000;
  int fifo_priority = 0;  ///< 0: the ordinary scheduler
};

/// "cyclictest 2.40". Throws std::runtime_error when it is not installed.
std::string cyclictest_version();

/// Runs for ticks * period. Throws std::runtime_error, with its output, when it can not run or its output is
/// invalid.
WakeupLatency run_cyclictest(const CyclictestOptions& options);

/// Reads the histogram (buckets of 1 ns) that cyclictest prints. A quantile beyond the last bucket is
/// reported as the printed maximum. Throws std::runtime_error for any other output.
WakeupLatency parse_cyclictest(const std::string& printed);

}  // namespace hil::bench
