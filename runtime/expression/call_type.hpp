#pragma once
// The type of a call of a function in an expression, by the function's signature.
//
// Threads: the one that compiles.

#include <cstdint>
#include <string_view>

#include "runtime/expression/function.hpp"
#include "runtime/expression/operand_types.hpp"

namespace hil::expression {

/// Null: there is none of that name.
const Function* function_named(std::string_view name);

/// Of a node that is a call, whose arguments have their types. `period_ns`: between two steps; 0: there are
/// no steps.
Type call_type(OperandTypes& operands, std::size_t node, std::int64_t period_ns);

}  // namespace hil::expression
