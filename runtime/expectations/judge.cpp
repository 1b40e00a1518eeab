#include "runtime/expectations/judge.hpp"

#include "runtime/signals/signal_expression.hpp"

namespace hil::expectations {

void ClaimCheck::condition(const config::Expression& condition, bool is_for_every_tick) const {
  const auto compiled =
      signals::SignalExpression::compile(condition, known, {.truth = true, .what = "the condition"},
                                         {.period_ns = period_ns, .seed = 0}, diagnostics);
  if (compiled && compiled->signals().empty())
    diagnostics.add(condition.place(), "the condition reads no signal, so it says nothing about the run");
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
