#pragma once
// Judges whether each time that one condition becomes true another one is true in time.
//
// A reaction begins on each tick on which `when` becomes true, and on the first tick if it is true there. It
// is in time when `then` is true on a tick from its begin to `within` after it, both included. A reaction
// whose time has not passed when the run ends, or during which `then` was unknown and never true, is not
// judged. At most 65536 reactions are open; beyond that the oldest is not judged.
//
// Threads: as Judge.

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/run/expectations.hpp"
#include "runtime/run/watched_condition.hpp"

namespace hil::run {

class ReactionJudge final : public Judge {
 public:
  /// Keeps the times of the first `max_samples` reactions, a million at most. Further ones are judged, too.
  ReactionJudge(const config::Expectation& expectation, const config::Reaction& claim,
                const signals::SignalTable& table, std::uint64_t max_samples,
                const expression::CompileOptions& options);

  void check(const signals::SignalTable& table, std::span<const Arrival> arrived,
             std::int64_t time_ns) noexcept override;
  report::Expectation result(const Extent& extent) const override;
  std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const override;

 private:
  struct Open {
    std::int64_t begin_ns = 0;
    bool was_unknown = false;  ///< `then`, on a tick since the begin
  };
  Open& oldest() noexcept { return open_[first_ % open_.size()]; }
  void begin(std::int64_t time_ns) noexcept;
  void complete_all(std::int64_t time_ns) noexcept;
  /// Ends those whose time has ended before.
  void end_before(std::int64_t time_ns) noexcept;

  const std::string name_;
  std::vector<WatchedCondition> conditions_;  ///< when, then
  Coverage coverage_;
  const std::int64_t within_ns_;
  const std::uint64_t at_least_;
  std::vector<Open> open_;  ///< a ring, the oldest first
  std::uint64_t first_ = 0, end_ = 0;
  Truth last_when_ = Truth::no;
  std::uint64_t in_time_ = 0, late_ = 0, not_judged_ = 0;
  std::int64_t slowest_ns_ = 0, slowest_begin_ns_ = 0;
  std::optional<std::int64_t> first_failure_ns_;
  std::vector<std::int64_t> samples_ns_;
};

}  // namespace hil::run
