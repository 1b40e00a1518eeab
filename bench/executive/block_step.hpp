#pragma once
// The cost of a step of a block.

#include <cstdint>

namespace hil::bench {

struct BlockStepCost {
  double median_us = 0.0;
  std::uint64_t steps = 0;
};

/// A step of a block with ten states, by the method of Runge and Kutta: ten lags in a row, with an input and
/// a variable. Median over rounds of `steps_per_round`. Throws std::runtime_error when the states are not
/// those of the exact solution.
BlockStepCost measure_block_step(int rounds, std::uint64_t steps_per_round);

}  // namespace hil::bench
