#pragma once
// tracks: a signal follows a column of a CSV file within a tolerance.
//
// The reference at run time t is the file's value at t, linear between its rows, in the unit of the signal.
// With `after_shift`, the signal is compared with the reference of t - s, for each constant shift s of at
// most that time, a multiple of the base period. The one with the smallest greatest error counts, of equal
// ones the shortest. Positive: the signal is later than the reference. Only instants at which the reference
// has a value for all shifts are judged; `at_least` and the coverage count the ticks among them.
//
// The margin is the tolerance less the greatest error, in the unit of the signal (of a temperature in K).

#include <memory>
#include <optional>

#include "runtime/expectations/judge.hpp"
#include "runtime/signals/csv_profile.hpp"

namespace hil::expectations {

/// A larger shift, in ticks, is refused: each tick compares with all of them.
inline constexpr std::int64_t max_shift_ticks = 1000;

struct Tracks {
  config::Word signal;
  std::shared_ptr<const signals::CsvProfile> reference;
  config::Place reference_place;
  config::Expression tolerance;
  std::int64_t max_shift_ns = 0;
  std::uint64_t at_least = 20;  ///< with fewer compared instants, not checked
};

void check_claim(const Tracks& claim, const ClaimCheck& check);
std::vector<signals::SignalId> judged_arrivals_of(const Tracks& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Tracks& claim, const JudgeContext& context);
PlotContent plot_content_of(const Tracks& claim, const signals::SignalTable& table);

config::ExpectationKind tracks_kind();

}  // namespace hil::expectations
