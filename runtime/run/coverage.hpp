#pragma once
// On how much of a run an expectation was evaluated, since "held" must mean that it was checked.
//
// A signal that comes from outside (SignalInfo::arrives) is unknown while it is not fresh. A tick on which
// the expectation's truth depends on an unknown signal is not evaluated. An expectation that did not fail is
// not checked when it was evaluated on too small a share of the ticks it covers, on none of them, or when
// such a signal was not fresh for longer than its own time-out.
//
// Threads: look from the base thread; shortfall after the run.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/signals/signal_table.hpp"

namespace hil::run {

/// The part of a run that was to be judged.
struct Extent {
  std::int64_t end_ns = 0;  ///< run time covered
  std::uint64_t ticks = 0;  ///< base ticks that were due; of a run that was cut short, those of its duration
  std::int64_t period_ns = 0;  ///< of the base tick
};

/// False for a signal that arrives from outside and is not fresh.
bool is_known(const signals::SignalTable& table, signals::SignalId signal) noexcept;

class Coverage {
 public:
  /// `signals`: those that the expectation reads. `min_share`: the share of its ticks that must be
  /// evaluated, 0 to 1.
  Coverage(const std::vector<signals::SignalId>& signals, const signals::SignalTable& table,
           double min_share);

  /// To be called once for each tick that ran and that the expectation covers. Neither allocates nor blocks.
  void check(const signals::SignalTable& table, std::int64_t time_ns, bool evaluated) noexcept;

  std::uint64_t evaluated_ticks() const noexcept { return evaluated_ticks_; }
  /// Why too few of `covered_ticks` were evaluated, or a signal was not fresh for too long, in words. Empty:
  /// neither.
  std::string shortfall(std::uint64_t covered_ticks) const;
  /// Whether `part` is at least the least share of `whole`, and not 0.
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
  /// The first interval in which a needed signal was not fresh for longer than its time-out.
  struct Lapse {
    std::size_t watched = 0;
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
  };

  std::vector<Watched> watched_;  ///< the signals that arrive from outside
  const double min_share_;
  std::uint64_t evaluated_ticks_ = 0;
  std::optional<Lapse> lapse_;
};

}  // namespace hil::run
