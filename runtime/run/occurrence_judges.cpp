#include "runtime/run/occurrence_judges.hpp"

#include <string>
#include <utility>
#include <vector>

#include "runtime/report/quantities.hpp"
#include "runtime/run/watched_condition.hpp"

namespace hil::run {
namespace {

std::string instant_text(std::int64_t time_ns) {
  return report::to_ascii(report::instant(time_ns));
}

class CountJudge final : public Judge {
 public:
  CountJudge(const config::Expectation& expectation, const config::Count& claim,
             const signals::SignalTable& table, const expression::CompileOptions& options)
      : name_(expectation.name),
        claim_(claim),
        condition_(claim.condition, table, options),
        coverage_(condition_.signals(), table, expectation.coverage) {}

  void check(const signals::SignalTable& table, std::span<const Arrival> /*arrived*/,
             std::int64_t time_ns) noexcept override {
    const Truth truth = condition_.truth(table, time_ns);
    coverage_.check(table, time_ns, truth != Truth::unknown);
    if (truth == Truth::yes && last_ != Truth::yes) {
      ++count_;
      last_ns_ = time_ns;
      if (claim_.max && count_ > *claim_.max && !exceeded_ns_) exceeded_ns_ = time_ns;
    }
    last_ = truth;
  }

  report::Expectation result(const Extent& extent) const override {
    std::string detail = condition_.text() + " became true " + report::counted(count_, "time", "times");
    if (count_ > 0) detail += ", last at " + instant_text(last_ns_);
    report::Expectation result{.name = name_,
                               .result = report::ExpectationResult::held,
                               .detail = detail,
                               .first_failure_ns = exceeded_ns_,
                               .evaluated_ticks = coverage_.evaluated_ticks(),
                               .covered_ticks = extent.ticks};
    const std::string shortfall = coverage_.shortfall(extent.ticks);
    if (exceeded_ns_) {
      result.result = report::ExpectationResult::failed;
      result.detail += "; at most " + std::to_string(*claim_.max) + " are permitted, exceeded at " +
                       instant_text(*exceeded_ns_);
    } else if (!shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and " + shortfall;
    } else if (count_ < claim_.min) {
      result.result = report::ExpectationResult::failed;
      result.first_failure_ns = extent.end_ns;
      result.detail += "; at least " + std::to_string(claim_.min) + " are required";
    }
    return result;
  }

 private:
  const std::string name_;
  const config::Count claim_;
  WatchedCondition condition_;
  Coverage coverage_;
  Truth last_ = Truth::no;
  std::uint64_t count_ = 0;
  std::int64_t last_ns_ = 0;
  std::optional<std::int64_t> exceeded_ns_;
};

class OrderJudge final : public Judge {
 public:
  OrderJudge(const config::Expectation& expectation, const config::Order& claim,
             const signals::SignalTable& table, const expression::CompileOptions& options)
      : name_(expectation.name),
        conditions_(compiled(claim, table, options)),
        coverage_(signals_of(conditions_), table, expectation.coverage),
        first_ns_(conditions_.size()) {}

  void check(const signals::SignalTable& table, std::span<const Arrival> /*arrived*/,
             std::int64_t time_ns) noexcept override {
    bool is_known = true;
    for (std::size_t i = 0; i < conditions_.size(); ++i) {
      const Truth truth = conditions_[i].truth(table, time_ns);
      if (first_ns_[i]) continue;
      if (truth == Truth::unknown) is_known = false;
      if (truth != Truth::yes) continue;
      first_ns_[i] = time_ns;
      if (i > 0 && !first_ns_[i - 1] && !early_) early_ = i;
    }
    coverage_.check(table, time_ns, is_known);
  }

  report::Expectation result(const Extent& extent) const override {
    std::string detail;
    std::optional<std::size_t> missing;
    for (std::size_t i = 0; i < conditions_.size(); ++i) {
      detail += (i == 0 ? "" : ", then ") + conditions_[i].text();
      detail += first_ns_[i] ? " at " + instant_text(*first_ns_[i]) : " never";
      if (!first_ns_[i] && !missing) missing = i;
    }
    report::Expectation result{.name = name_,
                               .result = report::ExpectationResult::held,
                               .detail = detail,
                               .first_failure_ns = std::nullopt,
                               .evaluated_ticks = coverage_.evaluated_ticks(),
                               .covered_ticks = extent.ticks};
    const std::string shortfall = coverage_.shortfall(extent.ticks);
    if (early_) {
      result.result = report::ExpectationResult::failed;
      result.first_failure_ns = first_ns_[*early_];
      result.detail +=
          ": '" + conditions_[*early_].text() + "' was true before '" + conditions_[*early_ - 1].text() + "'";
    } else if (!shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and " + shortfall;
    } else if (missing) {
      result.result = report::ExpectationResult::failed;
      result.first_failure_ns = extent.end_ns;
    }
    return result;
  }

 private:
  static std::vector<WatchedCondition> compiled(const config::Order& claim, const signals::SignalTable& table,
                                                expression::CompileOptions options) {
    std::vector<WatchedCondition> conditions;
    for (const config::Expression& condition : claim.conditions) {
      conditions.emplace_back(condition, table, options);
      options.seed = ~options.seed + 1;
    }
    return conditions;
  }

  const std::string name_;
  std::vector<WatchedCondition> conditions_;
  Coverage coverage_;
  std::vector<std::optional<std::int64_t>> first_ns_;  ///< by condition: when it was first true
  std::optional<std::size_t> early_;                   ///< the condition that was true before its turn
};

}  // namespace

std::unique_ptr<Judge> make_count_judge(const config::Expectation& expectation, const config::Count& claim,
                                        const signals::SignalTable& table,
                                        const expression::CompileOptions& options) {
  return std::make_unique<CountJudge>(expectation, claim, table, options);
}

std::unique_ptr<Judge> make_order_judge(const config::Expectation& expectation, const config::Order& claim,
                                        const signals::SignalTable& table,
                                        const expression::CompileOptions& options) {
  return std::make_unique<OrderJudge>(expectation, claim, table, options);
}

}  // namespace hil::run
