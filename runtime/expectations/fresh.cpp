#include "runtime/expectations/fresh.hpp"

#include "runtime/config/reading.hpp"
#include "runtime/expectations/received.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

class FreshJudge final : public Judge {
 public:
  FreshJudge(const Fresh& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        subject_(claim.name.text),
        received_(*find_received(subject_, context.table)),
        coverage_({}, context.table, context.arrivals, context.expectation) {}

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    const std::int64_t time_ns = instant.time_ns;
    const bool is_fresh = received_.is_fresh(table);
    if (!begin_ns_) begin_ns_ = time_ns;
    if (is_fresh && !first_ns_) first_ns_ = time_ns;
    if (!first_ns_) {
      const bool is_late = received_.timeout_ns > 0 && time_ns - *begin_ns_ > received_.timeout_ns;
      if (is_late && !first_failure_ns_) first_failure_ns_ = time_ns;
      came_before_ = received_.newest_ns(table) >= 0;
      return;
    }
    coverage_.check(table, instant, true);
    if (!is_fresh && !first_failure_ns_) first_failure_ns_ = time_ns;
    // A lost device has no stamp: then the last one counts.
    const std::int64_t stamp_ns = received_.newest_ns(table);
    if (stamp_ns > newest_ns_) newest_ns_ = stamp_ns;
    const std::int64_t age_ns = time_ns - newest_ns_;
    if (age_ns <= worst_age_ns_) return;
    worst_age_ns_ = age_ns;
    worst_ns_ = time_ns;
  }

  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    if (received_.is_fresh(table))
      coverage_.check(table, instant, true);
    else
      coverage_.check_unplaced(table, instant, in_gap);
  }

  report::Expectation result(const Extent& extent) const override {
    const std::string claim = "fresh " + subject_ + ": ";
    report::Expectation result = held_result(name_, coverage_, extent);
    result.first_failure_ns = first_failure_ns_;
    if (!first_ns_) {
      result.result =
          first_failure_ns_ ? report::ExpectationResult::failed : report::ExpectationResult::not_checked;
      result.detail = claim + (came_before_ ? "it was never fresh" : "it never arrived");
      return result;
    }
    result.covered_ticks -=
        std::min(extent.ticks, static_cast<std::uint64_t>((*first_ns_ - extent.begin_ns) / extent.period_ns));
    result.worst_ns = worst_ns_;
    if (received_.timeout_ns > 0) {
      result.margin = static_cast<double>(received_.timeout_ns - worst_age_ns_) / 1e9;
      result.margin_unit = "s";
    }
    result.detail = claim + "at most " + report::to_ascii(report::measured_time(worst_age_ns_)) +
                    " old, at " + instant_text(worst_ns_);
    const std::string shortfall = coverage_.shortfall(result.covered_ticks);
    if (first_failure_ns_) {
      result.result = report::ExpectationResult::failed;
      result.detail += "; not fresh at " + instant_text(*first_failure_ns_);
    } else if (!shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and " + shortfall;
    }
    return result;
  }

 private:
  const std::string name_, subject_;
  const Received received_;
  Coverage coverage_;
  std::optional<std::int64_t> begin_ns_;  ///< of its window
  std::optional<std::int64_t> first_ns_, first_failure_ns_;
  bool came_before_ = false;  ///< in the run, but not in the window while fresh
  std::int64_t newest_ns_ = 0, worst_age_ns_ = 0, worst_ns_ = 0;
};

config::Schema fresh_schema(std::span<const config::BusSectionType> /*buses*/) {
  return config::Schema::signal();
}

std::shared_ptr<const config::Claim> read_fresh(const config::Value& entry,
                                                const config::ClaimContext& /*context*/) {
  return claim_of(Fresh{config::word_of(entry["fresh"])});
}

}  // namespace

void check_claim(const Fresh& claim, const ClaimCheck& check) {
  check_received(claim.name, false, check);
  const auto received = find_received(claim.name.text, check.known.table());
  if (received && check.known.is_never_stale(received->signals.front())) {
    check.diagnostics.warn(claim.name.place,
                           "'" + claim.name.text +
                               "' has no time-out, so it stays fresh after its sender has stopped; give its "
                               "message a 'timeout' ('0 ms' if that is meant)");
  }
}

std::unique_ptr<Judge> judge_of(const Fresh& claim, const JudgeContext& context) {
  return std::make_unique<FreshJudge>(claim, context);
}
PlotContent plot_content_of(const Fresh& claim, const signals::SignalTable& table) {
  return plot_of(find_received(claim.name.text, table)->state());
}

config::ExpectationKind fresh_kind() {
  return {
      .key = "fresh",
      .about =
          "A received signal or message that arrives within its time-out and is then fresh on every tick.",
      .schema = fresh_schema,
      .read = read_fresh};
}

}  // namespace hil::expectations
