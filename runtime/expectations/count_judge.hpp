#pragma once
// Judges of how often and in which order conditions become true.
//
// count  the number of instants at which the condition becomes true, the first one included if it is true
//        there. Fails at the instant at which it exceeds `max`, or at the end of the run with fewer than
//        `min`. In a window it counts where the condition becomes true in the window.
// order  each condition is true for the first time at the instant of the one before it or later. Fails at
//        the first instant at which one is true before its turn, or at the end of the run without the last
//        one. The margin is the shortest time from one condition to the next; there is none while one was
//        never true.
//
// Threads: as Judge.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

/// How often the condition becomes true.
struct Count {
  config::Expression condition;
  std::uint64_t min = 0;
  std::optional<std::uint64_t> max;
};
/// The conditions become true one after the other.
struct Order {
  std::vector<config::Expression> conditions;
};

void check_claim(const Count& claim, const ClaimCheck& check);
void check_claim(const Order& claim, const ClaimCheck& check);
std::vector<signals::SignalId> judged_arrivals_of(const Count& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Count& claim, const JudgeContext& context);
PlotContent plot_content_of(const Count& claim, const signals::SignalTable& table);
std::vector<signals::SignalId> judged_arrivals_of(const Order& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Order& claim, const JudgeContext& context);
PlotContent plot_content_of(const Order& claim, const signals::SignalTable& table);

config::ExpectationKind count_kind();
config::ExpectationKind order_kind();

}  // namespace hil::expectations
