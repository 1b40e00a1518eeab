#pragma once
// cyclictest (package rt-tests), the yardstick of wake-up latency: a thread that sleeps until absolute
// instants and notes how late it wakes. Runs the program that is installed.

#include <cstdint>
#include <string>

namespace hil::bench {

struct WakeupLatency {
  double p50_us = 0.0;
  double p99_us = 0.0;
  std::uint64_t samples = 0;
  // Of cyclictest alone.
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

/// Takes ticks * period. Throws std::runtime_error, with what it said, when it can not run or its answer
/// makes no sense.
WakeupLatency run_cyclictest(const CyclictestOptions& options);

/// Reads the histogram (buckets of 1 ns) that cyclictest prints. A rank past the last bucket answers with the
/// printed maximum. Throws std::runtime_error on anything else.
WakeupLatency parse_cyclictest(const std::string& printed);

}  // namespace hil::bench
