#pragma once
// The type of a call in an expression: of a function by its signature, of a table by its axes.
//
// Threads: the one that compiles.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/expression/function.hpp"
#include "runtime/expression/operand_types.hpp"
#include "runtime/expression/table.hpp"

namespace hil::expression {

/// Null: there is none of that name.
const Function* function_named(std::string_view name);

/// Of a node that is a call, whose arguments have their types. `other_names`: what can be called besides the
/// functions, for suggestions. `period_ns`: between two steps; 0: there are no steps.
Type call_type(OperandTypes& operands, std::size_t node, std::vector<std::string> other_names,
               std::int64_t period_ns);
/// The same, of a call of a table.
Type table_call_type(OperandTypes& operands, std::size_t node, const Table& table);

}  // namespace hil::expression
