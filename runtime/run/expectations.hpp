#pragma once
// Judges what the scenario expects, tick by tick, without allocating. An expectation has held, has failed, or
// was not checked (coverage.hpp says when).
//
// never / always  fails on the first tick on which the condition is known to be true / false.
// eventually      is met on the first tick on which the condition is known to be true, not later than `by`.
// response        runtime/run/response_judge.hpp.
//
// Threads: the base thread judges; results are read after the run.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "runtime/config/scenario.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/arrivals.hpp"
#include "runtime/run/coverage.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::run {

/// Judges one expectation.
class Judge {
 public:
  virtual ~Judge() = default;
  /// After every tick, with what arrived since the tick before.
  virtual void check(const signals::SignalTable& table, std::span<const Arrival> arrived,
                     std::int64_t time_ns) noexcept = 0;
  virtual report::Expectation result(const Extent& extent) const = 0;
  /// Response times, where the expectation measures them.
  virtual std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const {
    (void)end_ns;
    return std::nullopt;
  }
};

/// Every name has been found in `table` when the scenario was wired. `arrivals` outlives the judge and knows
/// already what it will keep. `max_samples`: so many response times are kept, a
/// million at most.
std::unique_ptr<Judge> make_judge(const config::Expectation& expectation, const signals::SignalTable& table,
                                  const Arrivals& arrivals, std::uint64_t max_samples);

}  // namespace hil::run
