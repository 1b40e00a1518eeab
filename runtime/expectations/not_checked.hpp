#pragma once
// An expectation that no run can check, with the reason: as of a row of a test table after the end of the
// run.
//
// Threads: as in judge.hpp.

#include <memory>
#include <string>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

struct NotChecked {
  std::string reason;
};

void check_claim(const NotChecked& claim, const ClaimCheck& check);
std::unique_ptr<Judge> judge_of(const NotChecked& claim, const JudgeContext& context);
PlotContent plot_content_of(const NotChecked& claim, const signals::SignalTable& table);

}  // namespace hil::expectations
