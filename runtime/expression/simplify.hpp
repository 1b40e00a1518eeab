#pragma once
// What an expression is by its form alone, whatever its names are: x - x is 0, min(x, x) is x, `x or not x`
// is true. Claims use it to find conditions that can not fail or can not hold.
//
// Threads: pure functions.

#include <functional>
#include <string>
#include <string_view>

#include "runtime/config/expression.hpp"

namespace hil::expression {

/// The name that a name stands for; the same name where it stands for itself.
using NameSource = std::function<std::string(std::string_view name)>;

/// An expression with the same value wherever its value is known. The rules:
/// - Differences, quotients, comparisons, min and max of equal operands, clamp between equal limits,
///   conditionals with equal branches or a constant condition, and 0 or 1 as a neutral operand.
/// - `and` and `or` of equal, opposite or constant conditions.
/// - Functions with a memory whose first argument is constant, or whose reset is always true.
/// Calls of random functions are never equal.
config::Expression simplified(const config::Expression& expression, const NameSource& source);

/// Whether both are equal once they are simplified.
bool are_equal(const config::Expression& first, const config::Expression& second, const NameSource& source);

}  // namespace hil::expression
