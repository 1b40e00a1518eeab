#pragma once
// Judges the expectations of a scenario on every tick, without allocation. The result of an expectation is
// held, failed or not checked (coverage.hpp).
//
// never, always  fails on the first tick on which the condition is known to be true, or false.
// eventually     is held when the condition is known to be true on a tick not later than `by`.
// response       runtime/run/response_judge.hpp.
// reaction       runtime/run/reaction_judge.hpp.
// count, order   runtime/run/occurrence_judges.hpp.
//
// Threads: check from the base thread; results after the run.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "runtime/config/scenario.hpp"
#include "runtime/expression/program.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/arrivals.hpp"
#include "runtime/run/coverage.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::run {

/// Judges one expectation.
class Judge {
 public:
  virtual ~Judge() = default;
  /// After every tick, with the samples that arrived since the tick before.
  virtual void check(const signals::SignalTable& table, std::span<const Arrival> arrived,
                     std::int64_t time_ns) noexcept = 0;
  virtual report::Expectation result(const Extent& extent) const = 0;
  /// Response times, where the expectation measures them.
  virtual std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const {
    (void)end_ns;
    return std::nullopt;
  }
};

/// What compiling a condition of an expectation wants.
expression::Wanted wanted_condition();

/// `table` contains all names of the expectation, since wire() checked its condition. `arrivals` outlives the
/// judge and has the inputs that it keeps. `max_samples`: the number of response times that are kept, a
/// million at most. `options`: of its condition, with the period between two checks.
std::unique_ptr<Judge> make_judge(const config::Expectation& expectation, const signals::SignalTable& table,
                                  const Arrivals& arrivals, std::uint64_t max_samples,
                                  const expression::CompileOptions& options);

}  // namespace hil::run
