#pragma once
// The share of a run on which an expectation was evaluated: an expectation is held only if it was checked.
//
// A signal of a device (SignalInfo::arrives) is unknown while it is not fresh. A tick is evaluated unless
// the truth of the expectation depends on an unknown signal. An expectation that did not fail is not
// checked when none, or too small a share, of its ticks was evaluated, or when such a signal was not fresh
// for longer than its time-out.
//
// Threads: check from the base thread; shortfall after the run.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

/// The part of a run on which an expectation is evaluated: the run, or its window.
struct Extent {
  std::int64_t end_ns = 0;     ///< run time covered
  std::uint64_t ticks = 0;     ///< base ticks that were due, for a run that ended early those of its duration
  std::int64_t period_ns = 0;  ///< of the base tick
  std::int64_t begin_ns = 0;   ///< of the window
};

class Coverage {
 public:
  /// `signals`: those that the expectation reads. `min_share`: the least share of its ticks that must be
  /// evaluated, 0 to 1.
  Coverage(const std::vector<signals::SignalId>& signals, const signals::SignalTable& table,
           double min_share);

  /// To be called for each tick that ran and that the expectation covers. Neither allocates nor blocks.
  void check(const signals::SignalTable& table, std::int64_t time_ns, bool evaluated) noexcept;

  std::uint64_t evaluated_ticks() const noexcept { return evaluated_ticks_; }
  /// Why the expectation is not checked, in words: too few of `covered_ticks` were evaluated, or a signal
  /// was not fresh for too long. Empty: it is checked.
  std::string shortfall(std::uint64_t covered_ticks) const;
  /// Whether `part` is not 0 and at least min_share of `whole`.
  bool suffices(std::uint64_t part, std::uint64_t whole) const noexcept;
  /// "188 of 10000 ticks (1.8 %), less than its coverage of 95 %", "none of 10000 ticks"
  std::string share_text(std::uint64_t part, std::uint64_t whole, const std::string& what) const;

 private:
  struct Watched {
    signals::SignalId signal;
    std::string name;
    std::int64_t timeout_ns = 0;
    std::optional<std::int64_t> stale_since_ns;
  };
  /// The first interval in which a signal was not fresh for longer than its time-out.
  struct StaleInterval {
    std::size_t watched = 0;
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
  };

  std::vector<Watched> watched_;  ///< the signals of devices
  const double min_share_;
  std::uint64_t evaluated_ticks_ = 0;
  std::optional<StaleInterval> stale_interval_;
};

}  // namespace hil::expectations
