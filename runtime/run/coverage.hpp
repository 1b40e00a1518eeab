#pragma once
// How much of a run an expectation was evaluated on: "passed" has to mean that it was checked.
//
// A signal that comes from outside (SignalInfo::arrives) is unknown while it is not fresh. A tick on which
// the expectation's truth depends on an unknown signal is not evaluated. An expectation that did not fail is
// not checked when it was evaluated on too small a share of the ticks it covers, or when such a signal was
// not fresh for longer than its own time-out.
//
// Threads: look from the base thread; shortfall after the run.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/signals/signal_table.hpp"

namespace hil::run {

/// What there was of a run to judge.
struct Extent {
  std::int64_t end_ns = 0;  ///< run time covered
  std::uint64_t ticks = 0;  ///< base ticks that were due; of a run that was cut short, those of its duration
  std::int64_t period_ns = 0;  ///< of the base tick
};

/// Whether the signal has a value that can be judged now.
bool is_known(const signals::SignalTable& table, signals::SignalId signal) noexcept;

class Coverage {
 public:
  /// `signals`: those the expectation reads. `least_share`: of its ticks that have to be evaluated.
  Coverage(std::vector<signals::SignalId> signals, const signals::SignalTable& table, double least_share);

  /// Once for each tick that ran and that the expectation covers. Neither allocates nor blocks.
  void look(const signals::SignalTable& table, std::int64_t time_ns, bool evaluated) noexcept;

  std::uint64_t evaluated_ticks() const noexcept { return evaluated_ticks_; }
  /// Why `covered_ticks` were not evaluated well enough, in words; empty: they were.
  std::string shortfall(std::uint64_t covered_ticks) const;
  /// Whether `part` is enough of `whole`.
  bool suffices(std::uint64_t part, std::uint64_t whole) const noexcept;
  /// "188 of 10000 ticks (1.8 %), less than its coverage of 95 %"
  std::string share_text(std::uint64_t part, std::uint64_t whole, const std::string& what) const;

 private:
  struct Watched {
    signals::SignalId signal;
    std::string name;
    std::int64_t timeout_ns = 0;
    std::optional<std::int64_t> stale_since_ns;
  };
  /// The first stretch in which a signal that was needed was not fresh for longer than its time-out.
  struct Lapse {
    std::size_t watched = 0;
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
  };

  std::vector<Watched> watched_;  ///< those that arrive
  const double least_share_;
  std::uint64_t evaluated_ticks_ = 0;
  std::optional<Lapse> lapse_;
};

}  // namespace hil::run
