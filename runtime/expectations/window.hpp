#pragma once
// The window of an expectation: another judge sees only the instants of the window.
//
// The window opens at the first instant at `from` or later at which `after` is true. It is closed for good
// from the first instant after `to`, or from the first later instant at which `until` is true. While the
// condition that could open or close it is unknown, nobody knows whether an instant is in it
// (Judge::check_unplaced); where the condition is known to be false again, the window is as it was. An
// expectation whose window did not open is not checked.
//
// Threads: as Judge.

#include <memory>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

/// Adds the mistake of a time `within` of an expectation that is as long as the run or as its window, so that
/// nothing could be late. `entry`: the expectation.
void check_within(const config::Value& within, const config::Value& entry,
                  const config::ClaimContext& context);

/// The expectation in `context` has a window.
std::unique_ptr<Judge> make_windowed_judge(std::unique_ptr<Judge> judge, const JudgeContext& context);

}  // namespace hil::expectations
