#pragma once
// never, always: fails at the first instant at which the condition is known to be true, or false. The margin
// is the least one of all instants (margin.hpp).
//
// eventually: is held when the condition is known to be true at an instant not later than `by`. The margin is
// the time that was left; where it was never true, the greatest one of the instants up to `by` (margin.hpp).

#include <cstdint>
#include <memory>
#include <optional>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

struct Never {
  config::Expression condition;
};
struct Always {
  config::Expression condition;
};
struct Eventually {
  config::Expression condition;
  std::optional<std::int64_t> by_ns;  ///< run time; empty: by the end of the run, or of the window
};

void check_claim(const Never& claim, const ClaimCheck& check);
void check_claim(const Always& claim, const ClaimCheck& check);
void check_claim(const Eventually& claim, const ClaimCheck& check);
std::vector<signals::SignalId> judged_arrivals_of(const Never& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Never& claim, const JudgeContext& context);
PlotContent plot_content_of(const Never& claim, const signals::SignalTable& table);
std::vector<signals::SignalId> judged_arrivals_of(const Always& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Always& claim, const JudgeContext& context);
PlotContent plot_content_of(const Always& claim, const signals::SignalTable& table);
std::vector<signals::SignalId> judged_arrivals_of(const Eventually& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Eventually& claim, const JudgeContext& context);
PlotContent plot_content_of(const Eventually& claim, const signals::SignalTable& table);

config::ExpectationKind never_kind();
config::ExpectationKind always_kind();
config::ExpectationKind eventually_kind();

}  // namespace hil::expectations
