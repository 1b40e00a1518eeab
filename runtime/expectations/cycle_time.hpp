#pragma once
// cycle_time: each interval between two frames of a message, by their receive time stamps, is the period up
// to a tolerance.
//
// Every arrival with a value of the message is a frame, also several in one tick or with one time stamp.
// Where the device keeps no arrivals, the newest frame of each tick counts. Three kinds of intervals are
// judged: those between two frames of the window, the one from its begin to a first frame that is later than
// one time-out (without one: period plus tolerance), and the open one at its end if it is too long already.
// With fewer than `at_least` intervals, or with lost frames, the expectation is not checked.
//
// The margin is the tolerance less the greatest deviation of an interval from the period.

#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

struct CycleTime {
  config::Word message;
  std::int64_t period_ns = 0;
  std::int64_t tolerance_ns = 0;
  std::uint64_t at_least = 1;
};

void check_claim(const CycleTime& claim, const ClaimCheck& check);
std::vector<signals::SignalId> judged_arrivals_of(const CycleTime& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const CycleTime& claim, const JudgeContext& context);
PlotContent plot_content_of(const CycleTime& claim, const signals::SignalTable& table);

config::ExpectationKind cycle_time_kind();

}  // namespace hil::expectations
