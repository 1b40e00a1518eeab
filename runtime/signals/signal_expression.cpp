#include "runtime/signals/signal_expression.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hil::signals {

std::optional<SignalExpression> SignalExpression::compile(const config::Expression& expression,
                                                          const SignalScope& scope,
                                                          const expression::ResultSpec& spec,
                                                          const expression::CompileOptions& options,
                                                          config::Diagnostics& diagnostics) {
  auto program = expression::Program::compile(expression, scope, spec, options, diagnostics);
  if (!program) return std::nullopt;
  return SignalExpression(std::move(*program), scope.signals());
}

std::optional<SignalExpression> SignalExpression::compile(const config::Expression& expression,
                                                          const KnownSignals& known,
                                                          const expression::ResultSpec& spec,
                                                          const expression::CompileOptions& options,
                                                          config::Diagnostics& diagnostics) {
  known.add_relations(expression);
  for (const config::Expression::Node& node : expression.nodes())
    if (known.table().find(node.word.text)) known.find(node.word, diagnostics);
  auto compiled =
      compile(expression, SignalScope(expression, known.table(), &known), spec, options, diagnostics);
  if (!compiled || !compiled->is_constant(expression)) return compiled;
  compiled->constant_ = compiled->evaluate(known.table(), 0, Unpublished::initial_value);
  if (std::isfinite(*compiled->constant_)) return compiled;
  diagnostics.add(expression.place(),
                  spec.what + ": " + config::in_quotes(expression.text()) + " has no value");
  return std::nullopt;
}

bool SignalExpression::is_constant(const config::Expression& expression) const {
  const bool has_time = std::ranges::any_of(expression.nodes(), [](const config::Expression::Node& node) {
    return node.operation == config::Expression::Operation::name && node.word.text == "time";
  });
  return signals_.empty() && !program_.has_state() && !has_time;
}

std::optional<SignalExpression> SignalExpression::compile(const config::Expression& expression,
                                                          const SignalTable& table,
                                                          const expression::ResultSpec& spec,
                                                          const expression::CompileOptions& options,
                                                          config::Diagnostics& diagnostics) {
  return compile(expression, SignalScope(expression, table), spec, options, diagnostics);
}

double SignalExpression::evaluate(const SignalTable& table, Instant instant,
                                  Unpublished unpublished) noexcept {
  const double time_s = static_cast<double>(instant.time_ns) / 1e9;
  sample(table, signals_, unpublished, time_s, values_, written_);
  return program_.evaluate(values_, {.time_s = time_s, .written = written_, .is_tick = instant.is_tick});
}

double SignalExpression::value_in_all_steps(const KnownSignals* known) noexcept {
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    const auto constant = known == nullptr ? std::nullopt : known->constant(signals_[i]);
    values_[i] = constant.value_or(std::numeric_limits<double>::quiet_NaN());
  }
  return program_.value_in_all_steps(values_);
}

std::int64_t SignalExpression::nanoseconds(double time_s) noexcept {
  constexpr double max_time_s = 4e9;  // std::int64_t holds the difference of two, 8e18 ns
  return std::llround(std::clamp(time_s, -max_time_s, max_time_s) * 1e9);
}

std::vector<SignalId> signals_in(const config::Expression& expression, const SignalTable& table) {
  return SignalScope(expression, table).signals();
}

}  // namespace hil::signals
