#pragma once
// The expectations of a test table for one signal: at each of its instants, the signal is within a tolerance
// of a value. The margin is the least value of tolerance minus error, in the unit of the signal (of a
// temperature in K). If any instant can not be judged, the expectation is not checked.
//
// Threads: as in judge.hpp.

#include <memory>
#include <vector>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

struct Instants {
  config::Word signal;
  std::vector<config::InstantCheck> checks;
};

void check_claim(const Instants& claim, const ClaimCheck& check);
std::unique_ptr<Judge> judge_of(const Instants& claim, const JudgeContext& context);
PlotContent plot_content_of(const Instants& claim, const signals::SignalTable& table);

}  // namespace hil::expectations
