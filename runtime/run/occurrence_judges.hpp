#pragma once
// Judges of how often a condition becomes true, and in which order conditions do.
//
// count  the number of ticks on which the condition becomes true, the first tick included if it is true
// there.
//        Fails on the tick on which it exceeds `max`, or at the end of the run with fewer than `min`.
// order  each condition is true for the first time on the tick of the one before it or later. Fails on the
//        first tick on which one is true before its turn, or at the end of the run without the last one.
//
// Threads: as Judge.

#include <memory>

#include "runtime/run/expectations.hpp"

namespace hil::run {

std::unique_ptr<Judge> make_count_judge(const config::Expectation& expectation, const config::Count& claim,
                                        const signals::SignalTable& table,
                                        const expression::CompileOptions& options);
std::unique_ptr<Judge> make_order_judge(const config::Expectation& expectation, const config::Order& claim,
                                        const signals::SignalTable& table,
                                        const expression::CompileOptions& options);

}  // namespace hil::run
