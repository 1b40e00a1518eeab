#include "runtime/expectations/cycle_time.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include <hil/quantity.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/expectations/received.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

constexpr std::int64_t no_time_ns = std::numeric_limits<std::int64_t>::min();

class CycleTimeJudge final : public Judge {
 public:
  CycleTimeJudge(const CycleTime& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        claim_(claim),
        arrivals_(context.arrivals),
        received_(*find_received(claim.message.text, context.table)),
        coverage_({}, context.table, context.arrivals, context.expectation),
        has_arrivals_(std::ranges::all_of(received_.signals,
                                          [&](auto signal) { return context.arrivals.keeps(signal); })) {}

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    if (instant.is_tick) coverage_.check(table, instant, true);
    if (const auto stamp_ns = new_frame(table, instant)) judge_frame(*stamp_ns);
  }
  void skip(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    new_frame(table, instant);
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    if (instant.is_tick) coverage_.check_unplaced(table, instant, in_gap);
    const auto stamp_ns = new_frame(table, instant);
    if (stamp_ns && last_ns_ != no_time_ns) last_ns_ = *stamp_ns;
  }

  report::Expectation result(const Extent& extent) const override {
    Figures figures = figures_;
    // A first frame that is later than the time-out after the begin ends an interval, too.
    const std::int64_t begin_limit_ns =
        received_.timeout_ns > 0 ? received_.timeout_ns : claim_.period_ns + claim_.tolerance_ns;
    if (first_ns_ != no_time_ns && first_ns_ - extent.begin_ns > begin_limit_ns)
      figures.add(extent.begin_ns, first_ns_, claim_);
    if (last_ns_ != no_time_ns && extent.end_ns - last_ns_ > claim_.period_ns + claim_.tolerance_ns)
      figures.add(last_ns_, extent.end_ns, claim_);
    report::Expectation result = held_result(name_, coverage_, extent);
    result.detail = "cycle time of " + claim_.message.text + " " + duration_text(claim_.period_ns) + " +- " +
                    duration_text(claim_.tolerance_ns) + ": " + text_of(figures);
    result.first_failure_ns = figures.first_failure_ns;
    if (figures.count > 0) {
      result.margin = static_cast<double>(claim_.tolerance_ns - figures.worst_deviation_ns) / 1e9;
      result.margin_unit = "s";
      result.worst_ns = figures.worst_ns;
    }
    if (arrivals_.lost() > 0) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += "; can not be judged, " + arrivals_.lost_text();
    } else if (figures.outside > 0) {
      result.result = report::ExpectationResult::failed;
    } else if (figures.count < claim_.at_least) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += "; at least " + std::to_string(claim_.at_least) + " have to be judged";
    } else if (const std::string unplaced = coverage_.unplaced_text(); !unplaced.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += "; " + unplaced;
    }
    return result;
  }

 private:
  struct Figures {
    std::uint64_t count = 0, outside = 0;
    std::int64_t min_ns = 0, max_ns = 0, sum_ns = 0;
    std::int64_t worst_deviation_ns = -1, worst_ns = 0;
    std::optional<std::int64_t> first_failure_ns{};

    void add(std::int64_t begin_ns, std::int64_t end_ns, const CycleTime& claim) noexcept {
      const std::int64_t interval_ns = end_ns - begin_ns;
      min_ns = count == 0 ? interval_ns : std::min(min_ns, interval_ns);
      max_ns = count == 0 ? interval_ns : std::max(max_ns, interval_ns);
      sum_ns += interval_ns;
      ++count;
      const std::int64_t deviation_ns = std::abs(interval_ns - claim.period_ns);
      if (deviation_ns > worst_deviation_ns) {
        worst_deviation_ns = deviation_ns;
        worst_ns = end_ns;
      }
      if (deviation_ns <= claim.tolerance_ns) return;
      ++outside;
      // A frame that is too late fails when its time is over.
      const std::int64_t latest_ns = begin_ns + claim.period_ns + claim.tolerance_ns;
      const std::int64_t failed_ns = std::min(end_ns, latest_ns);
      if (!first_failure_ns || failed_ns < *first_failure_ns) first_failure_ns = failed_ns;
    }
  };

  static std::string text_of(const Figures& figures) {
    std::string text = std::to_string(figures.outside) + " of " +
                       counted(figures.count, "interval", "intervals") + " outside";
    if (figures.count == 0) return text;
    const auto count = static_cast<std::int64_t>(figures.count);
    return text + ", from " + duration_text(figures.min_ns) + " to " + duration_text(figures.max_ns) +
           ", mean " + report::to_ascii(report::measured_time(figures.sum_ns / count));
  }

  void judge_frame(std::int64_t stamp_ns) noexcept {
    if (last_ns_ == no_time_ns)
      first_ns_ = stamp_ns;
    else
      figures_.add(last_ns_, stamp_ns, claim_);
    last_ns_ = stamp_ns;
  }

  /// The stamp of the frame of this instant, in non-decreasing order.
  std::optional<std::int64_t> new_frame(const signals::SignalTable& table,
                                        signals::Instant instant) noexcept {
    if (instant.is_tick == has_arrivals_) return std::nullopt;
    // Signals of a multiplexer are not in each frame.
    const auto is_in_frame = [&](signals::SignalId signal) {
      return arrivals_.current().find(signal).has_value();
    };
    if (has_arrivals_ && std::ranges::none_of(received_.signals, is_in_frame)) return std::nullopt;
    const std::int64_t stamp_ns = has_arrivals_ ? arrivals_.current().time_ns : received_.newest_ns(table);
    if (stamp_ns < newest_ns_ || (stamp_ns == newest_ns_ && !has_arrivals_)) return std::nullopt;
    newest_ns_ = stamp_ns;
    return stamp_ns;
  }

  const std::string name_;
  const CycleTime claim_;
  const Arrivals& arrivals_;
  const Received received_;
  Coverage coverage_;
  const bool has_arrivals_;
  std::int64_t newest_ns_ = -1;  ///< of all frames; those before the run do not count
  std::int64_t first_ns_ = no_time_ns, last_ns_ = no_time_ns;  ///< of the judged frames
  Figures figures_;
};

config::Schema cycle_time_schema(std::span<const config::BusSectionType> /*buses*/) {
  using config::Field;
  using config::Schema;
  return Schema::record({
      Field::needed("message", Schema::signal(), "The received message, as 'can.car.BrakeCommand'."),
      Field::needed("period", config::duration_schema(config::min_duration_s),
                    "The time from one frame to the next."),
      Field::needed("tolerance", config::duration_schema(config::min_duration_s),
                    "The largest deviation from the period, less than the period."),
      Field::with_default("at_least", Schema::integer(1, 1'000'000'000), "1",
                          "The least number of intervals that have to be judged. With fewer, the expectation "
                          "is not checked."),
  });
}

std::shared_ptr<const config::Claim> read_cycle_time(const config::Value& entry,
                                                     const config::ClaimContext& context) {
  const config::Value& value = entry["cycle_time"];
  CycleTime claim{.message = config::word_of(value["message"]),
                  .period_ns = value["period"].duration_ns(),
                  .tolerance_ns = value["tolerance"].duration_ns(),
                  .at_least = static_cast<std::uint64_t>(value["at_least"].integer())};
  if (claim.tolerance_ns >= claim.period_ns) {
    context.diagnostics.add(value["tolerance"].place(),
                            "'tolerance': " + config::format_duration(claim.tolerance_ns) +
                                " is not less than the period, " + config::format_duration(claim.period_ns));
  }
  return claim_of(std::move(claim));
}

}  // namespace

void check_claim(const CycleTime& claim, const ClaimCheck& check) {
  check_received(claim.message, true, check);
}

std::vector<signals::SignalId> judged_arrivals_of(const CycleTime& claim, const signals::SignalTable& table) {
  return find_received(claim.message.text, table)->signals;
}

std::unique_ptr<Judge> judge_of(const CycleTime& claim, const JudgeContext& context) {
  return std::make_unique<CycleTimeJudge>(claim, context);
}
PlotContent plot_content_of(const CycleTime& claim, const signals::SignalTable& table) {
  return plot_of(find_received(claim.message.text, table)->state());
}

config::ExpectationKind cycle_time_kind() {
  return {.key = "cycle_time",
          .about = "A received message that comes in a regular interval.",
          .schema = cycle_time_schema,
          .read = read_cycle_time};
}

}  // namespace hil::expectations
