#include "runtime/expectations/judge.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "runtime/signals/signal_expression.hpp"

namespace hil::expectations {
namespace {

using Node = config::Expression::Node;

bool are_equal(std::span<const Node> nodes, std::uint32_t first, std::uint32_t second) {
  const Node& a = nodes[first];
  const Node& b = nodes[second];
  const auto symbol_of = [](const Node& node) { return node.unit ? node.unit->symbol : ""; };
  return a.operation == b.operation && a.word.text == b.word.text && a.number == b.number &&
         symbol_of(a) == symbol_of(b) &&
         std::ranges::equal(a.parts, b.parts, [&](std::uint32_t of_a, std::uint32_t of_b) {
           return are_equal(nodes, of_a, of_b);
         });
}

/// Adds the mistake of each comparison of a value with itself.
void check_operands(const config::Expression& condition, config::Diagnostics& diagnostics) {
  using Operation = config::Expression::Operation;
  for (const Node& node : condition.nodes()) {
    const bool is_comparison =
        node.operation >= Operation::equal && node.operation <= Operation::greater_or_equal;
    if (is_comparison && are_equal(condition.nodes(), node.parts[0], node.parts[1]))
      diagnostics.add(node.word.place, "both operands of '" + std::string(config::to_string(node.operation)) +
                                           "' are the same, so the comparison says nothing about the run");
  }
}

/// A condition that has one result, whatever is unknown in the run, can not fail or can not hold.
void check_result(signals::SignalExpression& compiled, const config::Expression& condition,
                  const signals::KnownSignals& known, config::Diagnostics& diagnostics) {
  const auto result_text = [](double truth) { return truth == 0.0 ? "false" : "true"; };
  if (const double truth = compiled.value_in_all_steps(nullptr); !std::isnan(truth)) {
    diagnostics.add(condition.place(), std::string("the condition is always ") + result_text(truth) +
                                           ", whatever its signals are, so it says nothing about the run");
  } else if (const double with_variables = compiled.value_in_all_steps(&known); !std::isnan(with_variables)) {
    diagnostics.warn(condition.place(), std::string("the condition is always ") +
                                            result_text(with_variables) +
                                            " with the variables of the scenario, so nothing is checked");
  }
}

}  // namespace

void ClaimCheck::condition(const config::Expression& condition, bool is_for_every_tick) const {
  auto compiled =
      signals::SignalExpression::compile(condition, known, {.truth = true, .what = "the condition"},
                                         {.period_ns = period_ns, .seed = 0}, diagnostics);
  if (compiled && compiled->signals().empty())
    diagnostics.add(condition.place(), "the condition reads no signal, so it says nothing about the run");
  else if (compiled)
    check_result(*compiled, condition, known, diagnostics);
  check_operands(condition, diagnostics);
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

report::Expectation held_result(const std::string& name, const Coverage& coverage, const Extent& extent) {
  return {.name = name,
          .result = report::ExpectationResult::held,
          .detail = {},
          .evaluated_ticks = coverage.evaluated_ticks(),
          .covered_ticks = extent.ticks,
          .not_evaluated = coverage.not_evaluated()};
}

}  // namespace hil::expectations
