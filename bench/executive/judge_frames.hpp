#pragma once
// The cost of judging the frames of a tick.

#include <cstdint>

namespace hil::bench {

struct JudgeFramesCost {
  double median_us = 0.0;  ///< of a tick
  std::uint64_t ticks = 0;
};

/// Ticks with 4,096 frames of one message, which 20 conditions and a variable read. Median over the ticks.
/// Throws std::runtime_error when a condition does not have the result that the frames give it.
JudgeFramesCost measure_judge_frames(std::uint64_t ticks);

}  // namespace hil::bench
