#pragma once
// The expectations of a test table for one signal: at each of its instants, the signal is within a tolerance
// of a value. The margin is the least difference of a tolerance and the error, in the unit of the signal (of
// a temperature in K). Each instant has to be judged, or it is not checked.

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

/// A claim that no run can check.
struct NotChecked {
  std::string reason;
};

void check_claim(const NotChecked& claim, const ClaimCheck& check);
std::unique_ptr<Judge> judge_of(const NotChecked& claim, const JudgeContext& context);
PlotContent plot_content_of(const NotChecked& claim, const signals::SignalTable& table);

/// Both, for config::load_scenario.
config::TableClaims table_claims();

}  // namespace hil::expectations
