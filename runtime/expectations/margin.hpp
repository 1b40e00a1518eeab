#pragma once
// The margin of a condition: by how much it is true (positive) or false (negative), as the robustness of
// signal temporal logic (Fainekos and Pappas 2009, Donze and Maler 2010).
//
// Of `a < b` it is b - a, of `a > b` it is a - b, in the unit of the operands; of `and` the smaller one, of
// `or` the larger one, of `not` the opposite. There is none where a part of the condition is no such
// comparison, or where comparisons have different dimensions.
//
// Threads: as the table's; at() neither allocates nor blocks.

#include <cstdint>
#include <optional>
#include <string>

#include "runtime/config/expression.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::expectations {

class ConditionMargin {
 public:
  /// wire() has checked the condition. `options`: those of the condition itself, so that both have the same
  /// random numbers.
  ConditionMargin(const config::Expression& condition, const signals::SignalTable& table,
                  const expression::CompileOptions& options);

  bool exists() const noexcept { return expression_.has_value(); }
  std::string unit() const { return expression_ ? expression_->unit() : ""; }
  /// Once at each instant, since it has functions with a memory of its own. NaN: there is none, or it is
  /// unknown.
  double at(const signals::SignalTable& table, signals::Instant instant) noexcept;

 private:
  std::optional<signals::SignalExpression> expression_;
};

}  // namespace hil::expectations
