#include "runtime/expectations/every_tick.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <hil/quantity.hpp>

#include "runtime/expectations/margin.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/expectations/watched_condition.hpp"

namespace hil::expectations {
namespace {

class EveryTickJudge final : public Judge {
 public:
  EveryTickJudge(const config::Expression& condition, bool required_truth, const JudgeContext& context)
      : name_(context.expectation.name),
        condition_(condition, context.table, context.options),
        margin_(condition, context.table, context.options),
        coverage_(condition_.signals(), context.table, context.arrivals, context.expectation),
        required_truth_(required_truth),
        has_margin_(margin_.exists()) {}

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    const Truth truth = condition_.truth(table, instant);
    const double of_condition = margin_.at(table, instant);
    const double margin = required_truth_ ? of_condition : 0.0 - of_condition;  // no -0
    coverage_.check(table, instant, truth != Truth::unknown);
    if (truth == Truth::unknown) return;
    const bool is_broken = (truth == Truth::yes) != required_truth_;
    if (is_broken && !first_failure_ns_) first_failure_ns_ = instant.time_ns;
    // False without a known margin, as of "false and unknown": the least one is not known.
    if (std::isnan(margin)) has_margin_ = has_margin_ && !is_broken;
    if (margin < worst_margin_) {
      worst_margin_ = margin;
      worst_ns_ = instant.time_ns;
    }
  }
  void skip(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    condition_.truth(table, instant);
    margin_.at(table, instant);
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    const Truth truth = condition_.truth(table, instant);
    margin_.at(table, instant);
    if (truth == Truth::unknown || (truth == Truth::yes) == required_truth_)
      coverage_.check(table, instant, truth != Truth::unknown);
    else
      coverage_.check_unplaced(table, instant, in_gap);
  }

  report::Expectation result(const Extent& extent) const override {
    const std::string claim = (required_truth_ ? "always " : "never ") + condition_.text();
    report::Expectation result = held_result(name_, coverage_, extent);
    result.first_failure_ns = first_failure_ns_;
    result.worst_ns = first_failure_ns_;
    if (has_margin_ && worst_ns_) {
      result.margin = worst_margin_;
      result.margin_unit = margin_.unit();
      result.worst_ns = worst_ns_;
    }
    if (first_failure_ns_) {
      result.result = report::ExpectationResult::failed;
      result.detail = claim + ": broken at " + instant_text(*first_failure_ns_);
    } else if (const std::string shortfall = coverage_.shortfall(extent.ticks); !shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail = claim + ": " + shortfall;
    } else {
      result.detail = claim + ": held for " + std::to_string(result.evaluated_ticks) +
                      (result.evaluated_ticks == 1 ? " tick" : " ticks");
    }
    return result;
  }

 private:
  const std::string name_;
  WatchedCondition condition_;
  ConditionMargin margin_;
  Coverage coverage_;
  const bool required_truth_;
  bool has_margin_;
  double worst_margin_ = std::numeric_limits<double>::infinity();
  std::optional<std::int64_t> worst_ns_, first_failure_ns_;
};

class EventuallyJudge final : public Judge {
 public:
  EventuallyJudge(const Eventually& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        condition_(claim.condition, context.table, context.options),
        margin_(claim.condition, context.table, context.options),
        coverage_(condition_.signals(), context.table, context.arrivals, context.expectation),
        by_ns_(claim.by_ns) {}

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    judged_in_last_check_ = !fulfilled_ns_;
    if (fulfilled_ns_) return;
    const Truth truth = condition_.truth(table, instant);
    const double margin = margin_.at(table, instant);
    if (truth == Truth::yes) fulfilled_ns_ = instant.time_ns;
    if (by_ns_ && instant.time_ns > *by_ns_) return;
    coverage_.check(table, instant, truth != Truth::unknown);
    if (truth != Truth::unknown && margin > best_margin_) {
      best_margin_ = margin;
      best_ns_ = instant.time_ns;
    }
  }
  void skip(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    condition_.truth(table, instant);
    margin_.at(table, instant);
  }

  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    judged_in_last_check_ = !fulfilled_ns_;
    if (fulfilled_ns_) return;
    const Truth truth = condition_.truth(table, instant);
    margin_.at(table, instant);
    if (by_ns_ && instant.time_ns > *by_ns_) return;
    if (truth == Truth::yes)
      coverage_.check_unplaced(table, instant, in_gap);
    else
      coverage_.check(table, instant, truth != Truth::unknown);
  }

  bool judged_in_last_check() const noexcept override { return judged_in_last_check_; }
  report::Expectation result(const Extent& extent) const override {
    const std::string claim = "eventually " + condition_.text();
    report::Expectation result = held_result(name_, coverage_, extent);
    result.covered_ticks = covered_ticks(extent);
    if (fulfilled_ns_) {
      result.margin = static_cast<double>(by_ns_.value_or(extent.end_ns) - *fulfilled_ns_) / 1e9;
      result.margin_unit = "s";
      result.worst_ns = fulfilled_ns_;
    } else if (best_ns_) {
      result.margin = best_margin_;
      result.margin_unit = margin_.unit();
      result.worst_ns = best_ns_;
    }
    if (fulfilled_ns_ && (!by_ns_ || *fulfilled_ns_ <= *by_ns_)) {
      result.detail = claim + ": at " + instant_text(*fulfilled_ns_);
      result.met_ns = fulfilled_ns_;
      return result;
    }
    const std::int64_t limit_ns = std::min(by_ns_.value_or(extent.end_ns), extent.end_ns);
    const std::string observed =
        fulfilled_ns_ ? "only at " + instant_text(*fulfilled_ns_) + ", required by " + instant_text(*by_ns_)
                      : "not in " + instant_text(limit_ns) +
                            (best_ns_ ? ", nearest at " + instant_text(*best_ns_) : "");
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
    if (*by_ns_ < extent.begin_ns) return 0;
    return std::min(extent.ticks, static_cast<std::uint64_t>((*by_ns_ - extent.begin_ns) / extent.period_ns) +
                                      1 + extent.ticks_before);
  }

  const std::string name_;
  WatchedCondition condition_;
  ConditionMargin margin_;
  Coverage coverage_;
  const std::optional<std::int64_t> by_ns_;
  std::optional<std::int64_t> fulfilled_ns_;
  double best_margin_ = -std::numeric_limits<double>::infinity();  ///< of the instants up to `by`
  std::optional<std::int64_t> best_ns_;
  bool judged_in_last_check_ = false;
};

config::Schema condition_schema(std::span<const config::BusSectionType> /*buses*/) {
  return config::Schema::text();
}

template <class Data>
std::shared_ptr<const config::Claim> read_every_tick(const config::Value& entry,
                                                     const config::ClaimContext& context) {
  auto condition = config::Expression::parse(entry[entry.chosen()], context.diagnostics);
  if (!condition) return nullptr;
  return claim_of(Data{std::move(*condition)});
}

std::shared_ptr<const config::Claim> read_eventually(const config::Value& entry,
                                                     const config::ClaimContext& context) {
  auto condition = config::Expression::parse(entry["eventually"], context.diagnostics);
  std::optional<std::int64_t> by_ns;
  if (entry.has("by")) {
    by_ns = entry["by"].duration_ns();
    if (context.duration_ns > 0 && *by_ns > context.duration_ns) {
      context.diagnostics.add(entry["by"].place(), "'by': " + config::format_duration(*by_ns) +
                                                       " is after the end of the run, which takes " +
                                                       config::format_duration(context.duration_ns) +
                                                       "; left out: by its end");
    }
  }
  if (!condition) return nullptr;
  return claim_of(Eventually{std::move(*condition), by_ns});
}

}  // namespace

void check_claim(const Never& claim, const ClaimCheck& check) {
  check.condition(claim.condition, true);
}
void check_claim(const Always& claim, const ClaimCheck& check) {
  check.condition(claim.condition, true);
}
void check_claim(const Eventually& claim, const ClaimCheck& check) {
  check.condition(claim.condition);
}

std::vector<signals::SignalId> judged_arrivals_of(const Never& claim, const signals::SignalTable& table) {
  return plot_content_of(claim, table).signals;
}
std::unique_ptr<Judge> judge_of(const Never& claim, const JudgeContext& context) {
  return std::make_unique<EveryTickJudge>(claim.condition, false, context);
}
PlotContent plot_content_of(const Never& claim, const signals::SignalTable& table) {
  return plot_of(claim.condition, table);
}
std::vector<signals::SignalId> judged_arrivals_of(const Always& claim, const signals::SignalTable& table) {
  return plot_content_of(claim, table).signals;
}
std::unique_ptr<Judge> judge_of(const Always& claim, const JudgeContext& context) {
  return std::make_unique<EveryTickJudge>(claim.condition, true, context);
}
PlotContent plot_content_of(const Always& claim, const signals::SignalTable& table) {
  return plot_of(claim.condition, table);
}
std::vector<signals::SignalId> judged_arrivals_of(const Eventually& claim,
                                                  const signals::SignalTable& table) {
  return plot_content_of(claim, table).signals;
}
std::unique_ptr<Judge> judge_of(const Eventually& claim, const JudgeContext& context) {
  return std::make_unique<EventuallyJudge>(claim, context);
}
PlotContent plot_content_of(const Eventually& claim, const signals::SignalTable& table) {
  return plot_of(claim.condition, table);
}

config::ExpectationKind never_kind() {
  return {.key = "never",
          .about = "A condition that is true at no instant.",
          .schema = condition_schema,
          .read = read_every_tick<Never>};
}
config::ExpectationKind always_kind() {
  return {.key = "always",
          .about = "A condition that is true at every instant.",
          .schema = condition_schema,
          .read = read_every_tick<Always>};
}
config::ExpectationKind eventually_kind() {
  return {.key = "eventually",
          .about = "A condition that is true at some instant.",
          .schema = condition_schema,
          .read = read_eventually};
}

}  // namespace hil::expectations
