#pragma once
// cycle_time: each interval between two frames of a message, by their receive time stamps, is the period up
// to a tolerance.
//
// On a bus that keeps all samples each frame counts, also several in one tick; else the newest of each tick.
// Of frames with one time stamp, as many count as a signal of the message has samples with it. An interval is
// judged when both of its frames arrive in ticks of the window. An interval that is open at the end counts
// when it is too long already, so a message that stops fails. With fewer than `at_least` judged intervals the
// expectation is not checked; so it is when samples were lost between the bus and the tick.
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
std::vector<signals::SignalId> sampled_signals(const CycleTime& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const CycleTime& claim, const JudgeContext& context);
PlotContent plot_content_of(const CycleTime& claim, const signals::SignalTable& table);

config::ExpectationKind cycle_time_kind();

}  // namespace hil::expectations
