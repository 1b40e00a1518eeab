#pragma once
// From the parameters of a block in a scenario to its equations.

#include <optional>
#include <vector>

#include <hil/module.hpp>

#include "runtime/modules/block/block.hpp"

namespace hil::modules {

struct CompiledBlock {
  BlockEquations equations;
  Ports ports;                              ///< its inputs are the inputs of the block, then its parameters
  std::vector<std::uint32_t> input_values;  ///< by input: its place among the values
  std::size_t inputs =
      0;  ///< the number without the parameters: behind their values is whether they are fresh
};

/// Empty with mistakes, all of them, at their places. `parameters` conform to block_schema().
std::optional<CompiledBlock> compile_block(const config::Value& parameters, const TaskParameters& task,
                                           config::Diagnostics& diagnostics);

}  // namespace hil::modules
