#pragma once
// The cost of a tick of a bench: plants, stimuli, faults, expectations and a recording.

#include <cstdint>

namespace hil::bench {

struct BenchTick {
  double median_us = 0.0;
  std::uint64_t ticks = 0;
};

/// A run in real time at 1 kHz of 20 blocks with three states each, 20 stimuli, 20 faults of signals and 30
/// expectations, with a recording of all signals: the time that a tick works. Median over rounds of the mean
/// of `ticks_per_round` ticks. Throws std::runtime_error when a run does not pass.
BenchTick measure_bench_tick(int rounds, std::uint64_t ticks_per_round);

}  // namespace hil::bench
