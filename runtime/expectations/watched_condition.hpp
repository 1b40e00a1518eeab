#pragma once
// A condition of an expectation, with the signals that it mentions.
//
// Threads: as the table's; truth() neither allocates nor blocks.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/require.hpp>

#include "runtime/config/expression.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::expectations {

enum class Truth : std::uint8_t { no, yes, unknown };

class WatchedCondition {
 public:
  /// wire() has checked the condition.
  WatchedCondition(const config::Expression& condition, const signals::SignalTable& table,
                   const expression::CompileOptions& options)
      : text_(condition.text()) {
    config::Diagnostics diagnostics;
    expression_ = signals::SignalExpression::compile(condition, table, {.truth = true}, options, diagnostics);
    config::require(expression_.has_value(), "a condition that wire() has checked");
  }

  /// Once at each instant.
  Truth truth(const signals::SignalTable& table, signals::Instant instant) noexcept {
    const double result = expression_->evaluate(table, instant, signals::Unpublished::unknown);
    became_true_ = result == 1.0 && last_known_ != Truth::yes;
    if (std::isnan(result)) return Truth::unknown;
    return last_known_ = result != 0.0 ? Truth::yes : Truth::no;
  }
  /// Whether the condition became true in the latest call of truth(): it is true, and was last known to be
  /// false, or was never known.
  bool became_true() const noexcept { return became_true_; }
  bool was_known() const noexcept { return last_known_ != Truth::unknown; }
  const std::string& text() const noexcept { return text_; }
  const std::vector<signals::SignalId>& signals() const noexcept { return expression_->signals(); }

 private:
  std::string text_;
  std::optional<signals::SignalExpression> expression_;
  Truth last_known_ = Truth::unknown;
  bool became_true_ = false;
};

/// The signals of all conditions, each once.
inline std::vector<signals::SignalId> signals_of(const std::vector<WatchedCondition>& conditions) {
  std::vector<signals::SignalId> all;
  for (const WatchedCondition& condition : conditions)
    for (const signals::SignalId signal : condition.signals())
      if (std::find(all.begin(), all.end(), signal) == all.end()) all.push_back(signal);
  return all;
}

}  // namespace hil::expectations
