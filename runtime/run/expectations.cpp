#include "runtime/run/expectations.hpp"

#include <algorithm>
#include <memory>

#include "runtime/report/quantities.hpp"
#include "runtime/run/occurrence_judges.hpp"
#include "runtime/run/reaction_judge.hpp"
#include "runtime/run/response_judge.hpp"
#include "runtime/run/watched_condition.hpp"

namespace hil::run {
namespace {

std::string at_second(std::int64_t time_ns) {
  return report::to_ascii(report::instant(time_ns));
}

class EveryTickJudge final : public Judge {
 public:
  EveryTickJudge(const config::Expectation& expectation, const config::Expression& condition, bool wanted,
                 const signals::SignalTable& table, const expression::CompileOptions& options)
      : name_(expectation.name),
        condition_(condition, table, options),
        coverage_(condition_.signals(), table, expectation.coverage),
        wanted_(wanted) {}

  void check(const signals::SignalTable& table, std::span<const Arrival> /*arrived*/,
             std::int64_t time_ns) noexcept override {
    const Truth truth = condition_.truth(table, time_ns);
    const bool evaluated = truth != Truth::unknown;
    coverage_.check(table, time_ns, evaluated);
    if (evaluated && !first_failure_ns_ && (truth == Truth::yes) != wanted_) first_failure_ns_ = time_ns;
  }

  report::Expectation result(const Extent& extent) const override {
    const std::string claim = (wanted_ ? "always " : "never ") + condition_.text();
    report::Expectation result{.name = name_,
                               .result = report::ExpectationResult::held,
                               .detail = {},
                               .first_failure_ns = first_failure_ns_,
                               .evaluated_ticks = coverage_.evaluated_ticks(),
                               .covered_ticks = extent.ticks};
    if (first_failure_ns_) {
      result.result = report::ExpectationResult::failed;
      result.detail = claim + ": broken at " + at_second(*first_failure_ns_);
    } else if (const std::string shortfall = coverage_.shortfall(extent.ticks); !shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail = claim + ": " + shortfall;
    } else {
      result.detail = claim + ": held for " + std::to_string(result.evaluated_ticks) + " ticks";
    }
    return result;
  }

 private:
  const std::string name_;
  WatchedCondition condition_;
  Coverage coverage_;
  const bool wanted_;
  std::optional<std::int64_t> first_failure_ns_;
};

class EventuallyJudge final : public Judge {
 public:
  EventuallyJudge(const config::Expectation& expectation, const config::Eventually& claim,
                  const signals::SignalTable& table, const expression::CompileOptions& options)
      : name_(expectation.name),
        condition_(claim.condition, table, options),
        coverage_(condition_.signals(), table, expectation.coverage),
        by_ns_(claim.by_ns) {}

  void check(const signals::SignalTable& table, std::span<const Arrival> /*arrived*/,
             std::int64_t time_ns) noexcept override {
    if (met_ns_) return;
    const Truth truth = condition_.truth(table, time_ns);
    if (truth == Truth::yes) met_ns_ = time_ns;
    if (!by_ns_ || time_ns <= *by_ns_) coverage_.check(table, time_ns, truth != Truth::unknown);
  }

  report::Expectation result(const Extent& extent) const override {
    const std::string claim = "eventually " + condition_.text();
    report::Expectation result{.name = name_,
                               .result = report::ExpectationResult::held,
                               .detail = {},
                               .first_failure_ns = std::nullopt,
                               .evaluated_ticks = coverage_.evaluated_ticks(),
                               .covered_ticks = covered_ticks(extent)};
    if (met_ns_ && (!by_ns_ || *met_ns_ <= *by_ns_)) {
      result.detail = claim + ": at " + at_second(*met_ns_);
      result.met_ns = met_ns_;
      return result;
    }
    const std::int64_t limit_ns = std::min(by_ns_.value_or(extent.end_ns), extent.end_ns);
    const std::string observed =
        met_ns_ ? "only at " + at_second(*met_ns_) + ", required by " + at_second(*by_ns_)
                : "not in " + at_second(limit_ns);
    const std::string shortfall = coverage_.shortfall(result.covered_ticks);
    result.result =
        shortfall.empty() ? report::ExpectationResult::failed : report::ExpectationResult::not_checked;
    result.detail = claim + ": " + observed + (shortfall.empty() ? "" : ", and " + shortfall);
    if (shortfall.empty()) result.first_failure_ns = limit_ns;
    return result;
  }

 private:
  std::uint64_t covered_ticks(const Extent& extent) const {
    if (!by_ns_ || extent.period_ns <= 0) return extent.ticks;
    return std::min(extent.ticks, static_cast<std::uint64_t>(*by_ns_ / extent.period_ns) + 1);
  }

  const std::string name_;
  WatchedCondition condition_;
  Coverage coverage_;
  const std::optional<std::int64_t> by_ns_;
  std::optional<std::int64_t> met_ns_;
};

}  // namespace

expression::Wanted wanted_condition() {
  return {.truth = true, .what = "the condition"};
}

std::unique_ptr<Judge> make_judge(const config::Expectation& expectation, const signals::SignalTable& table,
                                  const Arrivals& arrivals, std::uint64_t max_samples,
                                  const expression::CompileOptions& options) {
  if (const auto* never = std::get_if<config::Never>(&expectation.claim)) {
    return std::make_unique<EveryTickJudge>(expectation, never->condition, false, table, options);
  }
  if (const auto* always = std::get_if<config::Always>(&expectation.claim)) {
    return std::make_unique<EveryTickJudge>(expectation, always->condition, true, table, options);
  }
  if (const auto* eventually = std::get_if<config::Eventually>(&expectation.claim)) {
    return std::make_unique<EventuallyJudge>(expectation, *eventually, table, options);
  }
  if (const auto* reaction = std::get_if<config::Reaction>(&expectation.claim))
    return std::make_unique<ReactionJudge>(expectation, *reaction, table, max_samples, options);
  if (const auto* count = std::get_if<config::Count>(&expectation.claim))
    return make_count_judge(expectation, *count, table, options);
  if (const auto* order = std::get_if<config::Order>(&expectation.claim))
    return make_order_judge(expectation, *order, table, options);
  return std::make_unique<ResponseJudge>(expectation, std::get<config::Response>(expectation.claim), table,
                                         arrivals, max_samples);
}

}  // namespace hil::run
