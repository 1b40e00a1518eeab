#include "runtime/expectations/judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <hil/quantity.hpp>
#include <hil/unit.hpp>

#include "runtime/expression/simplify.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::expectations {
namespace {

using expression::NameSource;
using Node = config::Expression::Node;

/// Names of one signal are equal; variables stand for themselves.
NameSource own_names(const signals::KnownSignals& known) {
  return [&known](std::string_view name) {
    const auto signal = known.table().find(name);
    return signal ? known.table().info(*signal).name : std::string(name);
  };
}
NameSource names_of_sources(const signals::KnownSignals& known) {
  return [&known](std::string_view name) { return known.source_of(name); };
}

/// The part of an expression that ends with the node.
config::Expression part_of(const config::Expression& whole, std::uint32_t node) {
  std::vector<config::Expression::Node> nodes(whole.nodes().begin(), whole.nodes().begin() + node + 1);
  return whole.with_nodes(std::move(nodes));
}

/// Adds the mistake of each comparison of a value with itself. False: there is one.
bool check_operands(const config::Expression& condition, const signals::KnownSignals& known,
                    config::Diagnostics& diagnostics) {
  using Operation = config::Expression::Operation;
  const std::size_t before = diagnostics.count();
  for (const config::Expression::Node& node : condition.nodes()) {
    const bool is_comparison =
        node.operation >= Operation::equal && node.operation <= Operation::greater_or_equal;
    if (is_comparison && expression::are_equal(part_of(condition, node.parts[0]),
                                               part_of(condition, node.parts[1]), own_names(known)))
      diagnostics.add(node.word.place, "both operands of '" + std::string(config::to_string(node.operation)) +
                                           "' are the same, so the comparison says nothing about the run");
  }
  return diagnostics.count() == before;
}

/// 1 or 0 of a condition that is so in all steps, whatever its signals are, by its form or by its constants.
/// NaN: it depends on them. `constants`: null: those of the expression alone.
double result_in_all_steps(const config::Expression& condition, const ClaimCheck& check,
                           const NameSource& source, const signals::KnownSignals* constants) {
  for (const auto& form : {condition, expression::simplified(condition, source)}) {
    config::Diagnostics ignored;
    auto compiled =
        signals::SignalExpression::compile(form, check.known, {.truth = true, .what = "the condition"},
                                           {.period_ns = check.period_ns, .seed = 0}, ignored);
    if (!compiled) continue;
    if (const double truth = compiled->value_in_all_steps(constants); !std::isnan(truth)) return truth;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

struct ConstantValue {
  double value = 0.0;  ///< in the SI
  bool has_variable = false;
};

/// Empty: it is no constant.
std::optional<ConstantValue> constant_in(std::span<const Node> nodes, std::uint32_t index,
                                         const signals::KnownSignals& known) {
  using Operation = config::Expression::Operation;
  const Node& node = nodes[index];
  if (node.operation == Operation::number)
    return ConstantValue{.value = node.unit ? node.unit->to_si(node.number) : node.number};
  if (node.operation == Operation::name) {
    const auto signal = known.table().find(node.word.text);
    const auto value = signal ? known.constant(*signal) : std::nullopt;
    const auto unit = signal ? units::parse_unit(known.table().info(*signal).unit) : std::nullopt;
    if (!value) return std::nullopt;
    return ConstantValue{.value = unit ? unit->to_si().of(*value) : *value, .has_variable = true};
  }
  if (node.operation < Operation::add || node.operation > Operation::divide) return std::nullopt;
  const auto a = constant_in(nodes, node.parts[0], known), b = constant_in(nodes, node.parts[1], known);
  if (!a || !b) return std::nullopt;
  const bool has_variable = a->has_variable || b->has_variable;
  switch (node.operation) {
    case Operation::add:
      return ConstantValue{a->value + b->value, has_variable};
    case Operation::subtract:
      return ConstantValue{a->value - b->value, has_variable};
    case Operation::multiply:
      return ConstantValue{a->value * b->value, has_variable};
    default:
      return ConstantValue{a->value / b->value, has_variable};
  }
}

bool is_call_of(const Node& node, std::string_view function) {
  return node.operation == config::Expression::Operation::call && node.word.text == function;
}

/// Whether the value is a duration(), also by way of variables.
bool is_duration(const Node& node, const ClaimCheck& check) {
  if (is_call_of(node, "duration")) return true;
  // A variable with a signal is computed from earlier ones, so there is no circle.
  if (node.operation != config::Expression::Operation::name || !check.known.table().find(node.word.text))
    return false;
  const auto variable = std::ranges::find(check.variables, node.word.text,
                                          [](const config::VariableSection& v) { return v.name.text; });
  return variable != check.variables.end() && variable->expression &&
         is_duration(variable->expression->nodes().back(), check);
}

/// A condition that has one result, whatever is unknown in the run, can not fail or can not hold.
void check_result(const config::Expression& condition, const ClaimCheck& check) {
  const auto result_text = [](double truth) { return truth == 0.0 ? "false" : "true"; };
  if (const double truth = result_in_all_steps(condition, check, own_names(check.known), nullptr);
      !std::isnan(truth)) {
    check.diagnostics.add(condition.place(),
                          std::string("the condition is always ") + result_text(truth) +
                              ", whatever its signals are, so it says nothing about the run");
  } else if (const double with_variables =
                 result_in_all_steps(condition, check, names_of_sources(check.known), &check.known);
             !std::isnan(with_variables)) {
    check.diagnostics.warn(condition.place(),
                           std::string("the condition is always ") + result_text(with_variables) +
                               " with the variables of the scenario, so nothing is checked");
  }
}

}  // namespace

void ClaimCheck::times(const config::Expression& expression) const {
  using Operation = config::Expression::Operation;
  if (duration_ns <= 0) return;
  const std::span<const Node> nodes = expression.nodes();
  const auto check_time = [&](const Node& node, std::uint32_t time, const std::string& use) {
    const auto constant = constant_in(nodes, time, known);
    if (!constant || !(constant->value < 9e9)) return;  // std::int64_t holds 9.2e18 ns
    const std::int64_t time_ns = std::llround(constant->value * 1e9);
    if (time_ns < duration_ns) return;
    const std::string text = use + config::format_duration(time_ns) + ", which is as long as the run of " +
                             config::format_duration(duration_ns) + " or longer";
    if (constant->has_variable)
      diagnostics.warn(node.word.place, text + ", with the variables of the scenario");
    else
      diagnostics.add(node.word.place, text);
  };
  for (const Node& node : nodes) {
    if (node.operation >= Operation::equal && node.operation <= Operation::greater_or_equal) {
      for (const std::size_t side : {0U, 1U})
        if (is_duration(nodes[node.parts[side]], *this))
          check_time(node, node.parts[1 - side], "'duration' is compared with ");
    }
    if (is_call_of(node, "delay") && node.parts.size() >= 2)
      check_time(node, node.parts[1], "'delay' has a value of before ");
  }
}

void ClaimCheck::condition(const config::Expression& condition, bool is_for_every_tick) const {
  auto compiled =
      signals::SignalExpression::compile(condition, known, {.truth = true, .what = "the condition"},
                                         {.period_ns = period_ns, .seed = 0}, diagnostics);
  const bool has_time = std::ranges::any_of(
      condition.nodes(), [](const config::Expression::Node& node) { return node.word.text == "time"; });
  if (compiled && compiled->signals().empty())
    diagnostics.add(condition.place(),
                    has_time
                        ? "the condition reads no signal but the run time; 'between', 'by' and rows of a "
                          "test table are for given times, and a stimulus makes a signal of the time"
                        : "the condition reads no signal, so it says nothing about the run");
  else if (check_operands(condition, known, diagnostics) && compiled)
    check_result(condition, *this);
  if (compiled) times(condition);
  if (!is_for_every_tick) return;
  for (const config::Expression::Node& node : condition.nodes()) {
    const auto id = known.table().find(node.word.text);
    if (!id || !known.is_never_stale(*id)) continue;
    diagnostics.warn(node.word.place,
                     "'" + node.word.text +
                         "' has no time-out, so the expectation counts as checked after its sender has "
                         "stopped; give its message a 'timeout' ('0 ms' if that is meant)");
  }
}

void ClaimCheck::different(const config::Expression& first, const config::Expression& second,
                           const std::string& consequence) const {
  if (expression::are_equal(first, second, own_names(known)))
    diagnostics.add(second.place(), "this condition is that before it, so " + consequence);
  else if (expression::are_equal(first, second, names_of_sources(known)))
    diagnostics.warn(
        second.place(),
        "with the variables of the scenario this condition is that before it, so " + consequence);
}

report::Expectation held_result(const std::string& name, const Coverage& coverage, const Extent& extent,
                                const std::optional<PendingBegin>& oldest_pending) {
  return {.name = name,
          .result = report::ExpectationResult::held,
          .detail = {},
          .evaluated_ticks = coverage.evaluated_ticks(oldest_pending),
          .covered_ticks = extent.ticks,
          .not_evaluated = coverage.not_evaluated(extent, oldest_pending)};
}

}  // namespace hil::expectations
