#include "runtime/expectations/kinds.hpp"

#include <algorithm>

#include <hil/require.hpp>

#include "runtime/expectations/instants.hpp"
#include "runtime/expectations/window.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::expectations {

#define KIND(name) config::ExpectationKind name##_kind();
#include "runtime/expectations/table.def"
#undef KIND

namespace {

const Claim& claim_in(const config::Expectation& expectation) {
  const auto* const claim = dynamic_cast<const Claim*>(expectation.claim.get());
  config::require(claim != nullptr, "an expectation of a kind in table.def");
  return *claim;
}

}  // namespace

const std::vector<config::ExpectationKind>& kinds() {
#define KIND(name) name##_kind(),
  static const std::vector<config::ExpectationKind> all{
#include "runtime/expectations/table.def"
  };
#undef KIND
  return all;
}

config::TableClaims table_claims() {
  return {
      .at_instants = [](config::Word signal,
                        std::vector<config::InstantCheck> checks) -> std::shared_ptr<const config::Claim> {
        return claim_of(Instants{std::move(signal), std::move(checks)});
      }};
}

void check_expectation(const config::Expectation& expectation, const ClaimCheck& check) {
  claim_in(expectation).check(check);
  if (!expectation.window) return;
  if (expectation.window->after) check.condition(*expectation.window->after);
  if (expectation.window->until) check.condition(*expectation.window->until);
}

std::vector<signals::SignalId> signals_judged_by_arrival(const config::Expectation& expectation,
                                                         const signals::SignalTable& table) {
  std::vector<signals::SignalId> judged = claim_in(expectation).signals_judged_by_arrival(table);
  if (judged.empty() || !expectation.window) return judged;
  for (const auto* condition : {&expectation.window->after, &expectation.window->until}) {
    if (!*condition) continue;
    for (const signals::SignalId signal : signals::signals_in(**condition, table))
      if (std::ranges::find(judged, signal) == judged.end()) judged.push_back(signal);
  }
  return judged;
}

PlotContent plot_content(const config::Expectation& expectation, const signals::SignalTable& table) {
  PlotContent content = claim_in(expectation).plot_content(table);
  if (!expectation.window) return content;
  if (expectation.window->after) content.add(*expectation.window->after, table);
  if (expectation.window->until) content.add(*expectation.window->until, table);
  return content;
}

std::vector<signals::SignalId> signals_read(const config::Expectation& expectation,
                                            const signals::SignalTable& table) {
  return plot_content(expectation, table).signals;
}

std::unique_ptr<Judge> make_judge(const JudgeContext& context) {
  std::unique_ptr<Judge> judge = claim_in(context.expectation).make_judge(context);
  if (!context.expectation.window) return judge;
  return make_windowed_judge(std::move(judge), context);
}

}  // namespace hil::expectations
