#pragma once
// From the parameters of a block in a scenario to its equations.

#include <optional>
#include <vector>

#include "runtime/modules/block/block.hpp"
#include "runtime/modules/module.hpp"

namespace hil::modules {

struct CompiledBlock {
  BlockEquations equations;
  /// Values of the equations: the input i is at 2 i, and behind it whether it is fresh.
  Ports ports;
};

/// Empty with mistakes, all of them, at their places. `parameters` conform to block_schema().
std::optional<CompiledBlock> compile_block(const config::Value& parameters, const TaskParameters& task,
                                           config::Diagnostics& diagnostics);

}  // namespace hil::modules
