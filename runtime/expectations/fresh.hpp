#pragma once
// fresh: a received signal or message is fresh on every tick from its first arrival in the window on. If
// nothing arrives within one time-out after the begin of the window, it fails; without a time-out it is then
// not checked. The margin is the time-out less the greatest age (s).

#include <memory>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

struct Fresh {
  config::Word name;
};

void check_claim(const Fresh& claim, const ClaimCheck& check);
std::unique_ptr<Judge> judge_of(const Fresh& claim, const JudgeContext& context);
PlotContent plot_content_of(const Fresh& claim, const signals::SignalTable& table);

config::ExpectationKind fresh_kind();

}  // namespace hil::expectations
