#pragma once
// A judge evaluates one expectation at each instant, without allocation. An instant is a tick, or a frame
// before it (judges.hpp). The result of an expectation is held, failed or not checked (coverage.hpp);
// coverage counts ticks alone.
//
// Threads: check and skip from the base thread; results after the run.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/expectations/arrivals.hpp"
#include "runtime/expectations/coverage.hpp"
#include "runtime/expectations/plot_content.hpp"
#include "runtime/expression/program.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/signals/known_signals.hpp"
#include "runtime/signals/signal_scope.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

/// Judges one expectation.
class Judge {
 public:
  virtual ~Judge() = default;
  /// At an instant of the window: after a tick, or at a frame with a signal of
  /// Claim::signals_judged_by_arrival. At a frame `table` has its values, and for all other signals those of
  /// the instant before (the tick before, or an earlier frame).
  virtual void check(const signals::SignalTable& table, signals::Instant instant) noexcept = 0;
  /// At any other instant, which is not judged: functions with a memory advance.
  virtual void skip(const signals::SignalTable& /*table*/, signals::Instant /*instant*/) noexcept {}
  /// At an instant of which nobody knows whether it is in the window: functions with a memory advance, and an
  /// instant that would decide the result is not evaluated. `in_gap`: the condition of the window was known
  /// before, so that such an instant leaves the expectation not checked, whatever its coverage.
  virtual void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                              bool in_gap) noexcept = 0;
  /// Whether the latest check() judged its tick. Undefined after skip().
  virtual bool judged_in_last_check() const noexcept { return true; }
  virtual report::Expectation result(const Extent& extent) const = 0;
  /// Response times, where the expectation measures them.
  virtual std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const {
    (void)end_ns;
    return std::nullopt;
  }
};

/// A judge is made of these, besides its claim.
struct JudgeContext {
  const config::Expectation& expectation;
  const signals::SignalTable& table;   ///< with all names of the expectation, since wire() checked it
  const Arrivals& arrivals;            ///< outlives the judge and has the inputs that it keeps
  std::uint64_t duration_ticks = 0;    ///< of the run
  bool judges_frames = false;          ///< frames are instants too, so that a tick may have several
  expression::CompileOptions options;  ///< with the period between two ticks

  /// The greatest number of instants in the run.
  std::uint64_t max_instants() const noexcept {
    return judges_frames ? std::numeric_limits<std::uint64_t>::max() : duration_ticks;
  }
};

/// Checks a claim while the run is wired.
struct ClaimCheck {
  const signals::KnownSignals& known;
  std::int64_t period_ns = 0;    ///< of the base tick
  std::int64_t duration_ns = 0;  ///< of the run
  config::Diagnostics& diagnostics;
  std::span<const config::VariableSection> variables{};  ///< of the scenario

  /// Adds the mistake of each time of a function that is as long as the run: a `duration` does not reach it,
  /// and a `delay` has no value of the run after its first one. Where only a variable makes it so, a warning.
  void times(const config::Expression& expression) const;
  /// Adds the mistakes of a condition. `is_for_every_tick`: warns of signals that are never stale.
  void condition(const config::Expression& condition, bool is_for_every_tick = false) const;
  /// Adds a mistake at `second` where both conditions are the same, and a warning where variables make them
  /// so. `consequence`: "each reaction is in time".
  void different(const config::Expression& first, const config::Expression& second,
                 const std::string& consequence) const;
};

/// A claim of a kind of this folder.
class Claim : public config::Claim {
 public:
  /// Adds the mistakes.
  virtual void check(const ClaimCheck& check) const = 0;
  /// Signals of which every arrival is judged, not only the newest of a tick.
  virtual std::vector<signals::SignalId> signals_judged_by_arrival(
      const signals::SignalTable& table) const = 0;
  virtual std::unique_ptr<Judge> make_judge(const JudgeContext& context) const = 0;
  virtual PlotContent plot_content(const signals::SignalTable& table) const = 0;
};

/// A claim by its data, with the functions of its kind: check_claim, judge_of, plot_content_of, and
/// judged_arrivals_of where a kind judges every arrival.
template <class Data>
class ClaimOf final : public Claim {
 public:
  explicit ClaimOf(Data claimed) : data(std::move(claimed)) {}
  void check(const ClaimCheck& check) const override { check_claim(data, check); }
  std::vector<signals::SignalId> signals_judged_by_arrival(const signals::SignalTable& table) const override {
    if constexpr (requires { judged_arrivals_of(data, table); }) {
      return judged_arrivals_of(data, table);
    } else {
      static_cast<void>(table);
      return {};
    }
  }
  std::unique_ptr<Judge> make_judge(const JudgeContext& context) const override {
    return judge_of(data, context);
  }
  PlotContent plot_content(const signals::SignalTable& table) const override {
    return plot_content_of(data, table);
  }

  const Data data;
};

template <class Data>
std::shared_ptr<const config::Claim> claim_of(Data data) {
  return std::make_shared<ClaimOf<Data>>(std::move(data));
}

/// A result that holds so far, with the ticks of its coverage. `oldest_pending`: as in coverage.hpp.
report::Expectation held_result(const std::string& name, const Coverage& coverage, const Extent& extent,
                                const std::optional<PendingBegin>& oldest_pending = {});

}  // namespace hil::expectations
