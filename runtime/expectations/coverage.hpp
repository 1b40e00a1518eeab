#pragma once
// The share of a run on which an expectation was evaluated: an expectation is held only if it was checked.
//
// A signal is unknown until its task has published it, and one of a device (SignalInfo::arrives) also while
// it is not fresh. A tick is evaluated unless the truth of the expectation depends on an unknown signal. If a
// reaction or a request is open at the end, the ticks from its begin on count as not evaluated. An
// expectation that did not fail is not checked when
// - none, or too small a share, of its ticks was evaluated,
// - a tick was not evaluated because of a signal that was never known, whatever the share,
// - a signal of a device was not fresh for longer than its time-out, on ticks that were not evaluated,
// - at an instant with a result that depends on it, nobody knew whether the instant was in the window, since
//   `after` or `until` was known before and no longer,
// - or frames of its messages were lost between the bus and the tick.
//
// Threads: check from the base thread; the rest after the run.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/expectations/arrivals.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/signals/signal_scope.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

/// The part of a run on which an expectation is evaluated: the run, or its window.
struct Extent {
  std::int64_t end_ns = 0;     ///< run time covered
  std::uint64_t ticks = 0;     ///< base ticks that were due, for a run that ended early those of its duration
  std::int64_t period_ns = 0;  ///< of the base tick
  std::int64_t begin_ns = 0;   ///< of the window
  std::uint64_t ticks_before = 0;  ///< of `ticks`, those before begin_ns that may be in the window
};

/// Begin of a reaction or of a request that has no result yet.
struct PendingBegin {
  std::int64_t time_ns = 0;
  std::uint64_t evaluated_before = 0;  ///< evaluated ticks before it began
};

class Coverage {
 public:
  /// `signals`: those that the claim reads, without those of the window.
  Coverage(const std::vector<signals::SignalId>& signals, const signals::SignalTable& table,
           const Arrivals& arrivals, const config::Expectation& expectation);

  /// To be called at each instant that the expectation covers, in a tick that ran; frames do not count.
  /// Neither allocates nor blocks.
  void check(const signals::SignalTable& table, signals::Instant instant, bool evaluated) noexcept;
  /// Instead of check, at an instant that may be outside the window, and decides the result if it is inside
  /// (Judge::check_unplaced).
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant, bool in_gap) noexcept;

  /// `oldest_pending`, here and below: the oldest reaction or request that is open at the end.
  std::uint64_t evaluated_ticks(const std::optional<PendingBegin>& oldest_pending = {}) const noexcept;
  /// Why the expectation is not checked, in words. Empty: it is checked.
  std::string shortfall(std::uint64_t covered_ticks,
                        const std::optional<PendingBegin>& oldest_pending = {}) const;
  /// The reason of an instant in a gap of `after` or `until`. Empty: there was none.
  std::string unplaced_text() const;
  /// Whether `part` is not 0 and at least min_share of `whole`.
  bool suffices(std::uint64_t part, std::uint64_t whole) const noexcept;
  /// "188 of 10000 ticks (1.8 %), less than its coverage of 95 %", "none of 10000 ticks"
  std::string share_text(std::uint64_t part, std::uint64_t whole, const std::string& what) const;
  /// The first intervals that were not evaluated, with the signals that caused them.
  std::vector<report::NotEvaluated> not_evaluated(const Extent& extent,
                                                  const std::optional<PendingBegin>& oldest_pending) const;
  static constexpr std::size_t max_intervals = 20;

 private:
  struct SignalCoverage {
    signals::SignalId signal;
    std::string name;
    bool arrives = false;
    std::int64_t timeout_ns = 0;
    bool is_of_window = false;  ///< `after` or `until` reads it
    bool was_known = false;
    std::uint64_t ticks_not_evaluated = 0;  ///< because it was unknown
    std::optional<std::int64_t> stale_since_ns{};
  };
  /// The first interval in which a signal was not fresh for longer than its time-out.
  struct StaleInterval {
    std::size_t signal = 0;  ///< index into signals_
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
  };
  struct Interval {
    std::int64_t begin_ns = 0, end_ns = 0;
  };

  /// `of_window`: the signals of the window, and no others, are why the tick was not evaluated.
  void check_tick(const signals::SignalTable& table, std::int64_t time_ns, bool evaluated,
                  bool of_window) noexcept;
  void note_stale(SignalCoverage& signal, std::size_t index, std::int64_t time_ns, bool evaluated) noexcept;
  void note_not_evaluated(std::int64_t time_ns) noexcept;

  std::vector<SignalCoverage> signals_;
  const Arrivals* arrivals_;  ///< null: it judges no frames
  const double min_share_;
  std::uint64_t evaluated_ticks_ = 0;
  std::optional<StaleInterval> stale_interval_;
  std::optional<std::int64_t> unplaced_ns_;  ///< the first instant in a gap of `after` or `until`
  bool was_evaluated_ = true;                ///< the last tick
  std::int64_t last_tick_ns_ = -1;
  bool is_listed_ = false;  ///< the newest interval is in intervals_
  std::vector<Interval> intervals_;
  std::vector<bool> causes_;  ///< by interval and signal
};

}  // namespace hil::expectations
