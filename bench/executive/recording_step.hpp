#pragma once
// The cost of a recording in the tick.

#include <cstdint>

namespace hil::bench {

struct RecordingCost {
  double median_us = 0.0;
  std::uint64_t ticks = 0;
};

/// What a recording of 200 signals, which ten modules write on each tick, adds to a tick of 1 ms. Median over
/// rounds of the mean of `ticks_per_round` ticks. Throws std::runtime_error when a message was dropped.
RecordingCost measure_recording(int rounds, std::uint64_t ticks_per_round);

}  // namespace hil::bench
