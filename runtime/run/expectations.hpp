#pragma once
// Watches what the scenario expects, tick by tick, without allocating.
//
// never / always  judged after every tick.
// eventually      met by the first tick that fulfils it, not later than its time.
// response        every change of the request signal is one request, known by its value and time; it is
//                 answered by the first change of the reply signal to the same value that does not come
//                 before it. A reply passes over older requests: they stay unanswered. At most 65536 wait at
//                 once; beyond, the oldest counts as unanswered. Requests that the run's end leaves less than
//                 the limit for are not judged.
//
// Threads: the base thread judges; results are read after the run.

#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::run {

/// Judges one expectation.
class Judge {
 public:
  virtual ~Judge() = default;
  virtual void look(const signals::SignalTable& table, std::int64_t time_ns) noexcept = 0;
  virtual report::Expectation result(std::int64_t end_ns) const = 0;
  /// Response times, where the expectation measures them.
  virtual std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const {
    (void)end_ns;
    return std::nullopt;
  }
};

/// Every name has been found in `table` when the scenario was wired. `most_samples`: looks at most, so many
/// response times are kept.
std::unique_ptr<Judge> make_judge(const config::Expectation& expectation, const signals::SignalTable& table,
                                  std::uint64_t most_samples);

}  // namespace hil::run
