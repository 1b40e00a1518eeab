#include "runtime/expectations/count_judge.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "runtime/expectations/time_text.hpp"
#include "runtime/expectations/watched_condition.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

class CountJudge final : public Judge {
 public:
  CountJudge(const Count& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        claim_(claim),
        condition_(claim.condition, context.table, context.options),
        coverage_(condition_.signals(), context.table, context.arrivals, context.expectation) {}

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    coverage_.check(table, instant, condition_.truth(table, instant) != Truth::unknown);
    if (!condition_.became_true()) return;
    ++count_;
    last_ns_ = instant.time_ns;
    if (claim_.max && count_ > *claim_.max && !exceeded_ns_) exceeded_ns_ = instant.time_ns;
  }
  void skip(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    condition_.truth(table, instant);
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    const Truth truth = condition_.truth(table, instant);
    if (condition_.became_true())
      coverage_.check_unplaced(table, instant, in_gap);
    else
      coverage_.check(table, instant, truth != Truth::unknown);
  }

  report::Expectation result(const Extent& extent) const override {
    std::string detail = condition_.text() + " became true " + counted(count_, "time", "times");
    if (count_ > 0) detail += ", last at " + instant_text(last_ns_);
    report::Expectation result = held_result(name_, coverage_, extent);
    result.detail = detail;
    result.first_failure_ns = exceeded_ns_;
    result.margin = margin();
    if (count_ > 0) result.worst_ns = exceeded_ns_ ? exceeded_ns_ : last_ns_;
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
  /// The distance to the nearer limit.
  double margin() const {
    const auto count = static_cast<double>(count_);
    const double above_min = count - static_cast<double>(claim_.min);
    if (!claim_.max) return above_min;
    const double below_max = static_cast<double>(*claim_.max) - count;
    return claim_.min == 0 ? below_max : std::min(above_min, below_max);
  }

  const std::string name_;
  const Count claim_;
  WatchedCondition condition_;
  Coverage coverage_;
  std::uint64_t count_ = 0;
  std::int64_t last_ns_ = 0;
  std::optional<std::int64_t> exceeded_ns_;
};

class OrderJudge final : public Judge {
 public:
  OrderJudge(const Order& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        conditions_(compiled(claim, context)),
        coverage_(signals_of(conditions_), context.table, context.arrivals, context.expectation),
        first_ns_(conditions_.size()) {}

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    bool is_evaluated = true;  // false: a condition is unknown that has not been true yet
    for (std::size_t i = 0; i < conditions_.size(); ++i) {
      const Truth truth = conditions_[i].truth(table, instant);
      if (first_ns_[i]) continue;
      if (truth == Truth::unknown) is_evaluated = false;
      if (truth != Truth::yes) continue;
      first_ns_[i] = instant.time_ns;
      if (i > 0 && !first_ns_[i - 1] && !early_) early_ = i;
    }
    coverage_.check(table, instant, is_evaluated);
  }
  void skip(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    for (WatchedCondition& condition : conditions_)
      condition.truth(table, instant);
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    bool is_evaluated = true, decides = false;
    for (std::size_t i = 0; i < conditions_.size(); ++i) {
      const Truth truth = conditions_[i].truth(table, instant);
      if (first_ns_[i]) continue;
      if (truth == Truth::unknown) is_evaluated = false;
      if (truth == Truth::yes) decides = true;
    }
    if (decides)
      coverage_.check_unplaced(table, instant, in_gap);
    else
      coverage_.check(table, instant, is_evaluated);
  }

  report::Expectation result(const Extent& extent) const override {
    std::string detail;
    std::optional<std::size_t> missing;
    for (std::size_t i = 0; i < conditions_.size(); ++i) {
      detail += (i == 0 ? "" : ", then ") + conditions_[i].text();
      detail += first_ns_[i] ? " at " + instant_text(*first_ns_[i]) : " never";
      if (!first_ns_[i] && !missing) missing = i;
    }
    report::Expectation result = held_result(name_, coverage_, extent);
    result.detail = detail;
    if (!missing) add_margin(result);
    const std::string shortfall = coverage_.shortfall(extent.ticks);
    if (early_) {
      result.result = report::ExpectationResult::failed;
      result.first_failure_ns = first_ns_[*early_];
      if (missing) result.worst_ns = first_ns_[*early_];
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
  /// The shortest time from one condition to the next. All have been true.
  void add_margin(report::Expectation& result) const {
    std::optional<std::int64_t> shortest_ns;
    for (std::size_t i = 1; i < first_ns_.size(); ++i) {
      const std::int64_t time_ns = *first_ns_[i] - *first_ns_[i - 1];
      if (shortest_ns && time_ns >= *shortest_ns) continue;
      shortest_ns = time_ns;
      result.worst_ns = first_ns_[i];
    }
    if (!shortest_ns) return;
    result.margin = static_cast<double>(*shortest_ns) / 1e9;
    result.margin_unit = "s";
  }

  static std::vector<WatchedCondition> compiled(const Order& claim, const JudgeContext& context) {
    std::vector<WatchedCondition> conditions;
    expression::CompileOptions options = context.options;
    for (const config::Expression& condition : claim.conditions) {
      conditions.emplace_back(condition, context.table, options);
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

config::Schema count_schema(std::span<const config::BusSectionType> /*buses*/) {
  using config::Field;
  using config::Schema;
  return Schema::record({
      Field::needed("of", Schema::text(), "A condition. Each time that it becomes true counts."),
      Field::with_default("min", Schema::integer(0, 1'000'000'000'000), "0", "The least number."),
      Field::optional("max", Schema::integer(0, 1'000'000'000'000),
                      "The largest number. Left out: no limit."),
  });
}

std::shared_ptr<const config::Claim> read_count(const config::Value& entry,
                                                const config::ClaimContext& context) {
  const config::Value& value = entry["count"];
  auto condition = config::Expression::parse(value["of"], context.diagnostics);
  const auto min = static_cast<std::uint64_t>(value["min"].integer());
  std::optional<std::uint64_t> max;
  if (value.has("max")) max = static_cast<std::uint64_t>(value["max"].integer());
  if (max && *max < min) {
    context.diagnostics.add(value["max"].place(),
                            "'max': " + std::to_string(*max) + " is less than 'min', " + std::to_string(min));
  }
  if (!max && min == 0)
    context.diagnostics.add(value.place(),
                            "'count' needs a 'min' of at least 1, a 'max', or both; "
                            "without them every count holds");
  if (!condition) return nullptr;
  return claim_of(Count{std::move(*condition), min, max});
}

config::Schema order_schema(std::span<const config::BusSectionType> /*buses*/) {
  return config::Schema::list(config::Schema::text(), 2, 100);
}

std::shared_ptr<const config::Claim> read_order(const config::Value& entry,
                                                const config::ClaimContext& context) {
  Order order;
  for (const config::Value& text : entry["order"].items()) {
    if (auto condition = config::Expression::parse(text, context.diagnostics))
      order.conditions.push_back(std::move(*condition));
  }
  return claim_of(std::move(order));
}

}  // namespace

void check_claim(const Count& claim, const ClaimCheck& check) {
  check.condition(claim.condition);
}
void check_claim(const Order& claim, const ClaimCheck& check) {
  for (const config::Expression& condition : claim.conditions)
    check.condition(condition);
  for (std::size_t i = 1; i < claim.conditions.size(); ++i)
    check.different(claim.conditions[i - 1], claim.conditions[i], "they have no order");
}

std::vector<signals::SignalId> judged_arrivals_of(const Count& claim, const signals::SignalTable& table) {
  return plot_content_of(claim, table).signals;
}
std::unique_ptr<Judge> judge_of(const Count& claim, const JudgeContext& context) {
  return std::make_unique<CountJudge>(claim, context);
}
PlotContent plot_content_of(const Count& claim, const signals::SignalTable& table) {
  return plot_of(claim.condition, table);
}
std::vector<signals::SignalId> judged_arrivals_of(const Order& claim, const signals::SignalTable& table) {
  return plot_content_of(claim, table).signals;
}
std::unique_ptr<Judge> judge_of(const Order& claim, const JudgeContext& context) {
  return std::make_unique<OrderJudge>(claim, context);
}
PlotContent plot_content_of(const Order& claim, const signals::SignalTable& table) {
  PlotContent content;
  for (const config::Expression& condition : claim.conditions)
    content.add(condition, table);
  return content;
}

config::ExpectationKind count_kind() {
  return {.key = "count",
          .about = "How often a condition becomes true.",
          .schema = count_schema,
          .read = read_count};
}
config::ExpectationKind order_kind() {
  return {.key = "order",
          .about = "Conditions that become true for the first time in this order.",
          .schema = order_schema,
          .read = read_order};
}

}  // namespace hil::expectations
