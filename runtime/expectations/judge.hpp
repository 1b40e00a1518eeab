#pragma once
// A judge evaluates one expectation at each instant, without allocation. An instant is a tick, or a frame
// before it (judges.hpp). The result of an expectation is held, failed or not checked (coverage.hpp);
// coverage counts ticks alone.
//
// Threads: check, skip, check_frame and skip_frame from the base thread; results after the run. `time_ns` is
// run time.

#include <cstdint>
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
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

/// Judges one expectation.
class Judge {
 public:
  virtual ~Judge() = default;
  /// After a tick of the window, with the samples that arrived since the tick before.
  virtual void check(const signals::SignalTable& table, std::span<const Arrival> arrived,
                     std::int64_t time_ns) noexcept = 0;
  /// After any other tick, which is not judged: functions with a memory advance.
  virtual void skip(const signals::SignalTable& table, std::span<const Arrival> arrived,
                    std::int64_t time_ns) noexcept = 0;
  /// At a frame of the window: `table` has the values of the frame, and for all other signals those of the
  /// instant before (the tick before, or an earlier frame). A judge that judges ticks alone overrides neither
  /// of the two.
  virtual void check_frame(const signals::SignalTable& /*table*/, std::int64_t /*time_ns*/) noexcept {}
  /// At any other frame, which is not judged: functions with a memory advance.
  virtual void skip_frame(const signals::SignalTable& /*table*/, std::int64_t /*time_ns*/) noexcept {}
  /// Whether the latest check() judged its tick. Undefined after skip().
  virtual bool judged_in_last_check() const noexcept { return true; }
  virtual report::Expectation result(const Extent& extent) const = 0;
  /// Response times, where the expectation measures them.
  virtual std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const {
    (void)end_ns;
    return std::nullopt;
  }
};

/// What a judge is made of, besides its claim.
struct JudgeContext {
  const config::Expectation& expectation;
  const signals::SignalTable& table;   ///< with all names of the expectation, since wire() checked it
  const Arrivals& arrivals;            ///< outlives the judge and has the inputs that it keeps
  std::uint64_t max_samples = 0;       ///< response times that are kept, a million at most
  expression::CompileOptions options;  ///< with the period between two checks
};

/// What checks a claim while the run is wired.
struct ClaimCheck {
  const signals::KnownSignals& known;
  std::int64_t period_ns = 0;    ///< of the base tick
  std::int64_t duration_ns = 0;  ///< of the run
  config::Diagnostics& diagnostics;

  /// Adds the mistakes of a condition. `is_for_every_tick`: warns of signals that are never stale.
  void condition(const config::Expression& condition, bool is_for_every_tick = false) const;
};

/// A claim of a kind of this folder.
class Claim : public config::Claim {
 public:
  /// Adds the mistakes.
  virtual void check(const ClaimCheck& check) const = 0;
  /// Signals of which every arrival is judged, not only the newest of a tick.
  virtual std::vector<signals::SignalId> sampled(const signals::SignalTable& table) const = 0;
  virtual std::unique_ptr<Judge> make_judge(const JudgeContext& context) const = 0;
  virtual PlotContent plot_content(const signals::SignalTable& table) const = 0;
};

/// A claim by its data, with the functions of its kind: check_claim, judge_of, plot_content_of, and
/// sampled_signals where a kind judges every sample.
template <class Data>
class ClaimOf final : public Claim {
 public:
  explicit ClaimOf(Data claimed) : data(std::move(claimed)) {}
  void check(const ClaimCheck& check) const override { check_claim(data, check); }
  std::vector<signals::SignalId> sampled(const signals::SignalTable& table) const override {
    if constexpr (requires { sampled_signals(data, table); }) {
      return sampled_signals(data, table);
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

/// A result that holds so far, with the ticks of its coverage.
report::Expectation held_result(const std::string& name, const Coverage& coverage, const Extent& extent);

}  // namespace hil::expectations
