#include "runtime/expectations/instants.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <hil/unit.hpp>

#include "runtime/expectations/signal_constant.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

/// The word of an expression that is nothing else; null otherwise.
const config::Word* sole_word_of(const config::Expression& expression) {
  using Operation = config::Expression::Operation;
  const config::Expression::Node& node = expression.nodes().back();
  const bool is_word = node.operation == Operation::name || node.operation == Operation::quoted;
  return is_word ? &node.word : nullptr;
}

/// What is expected at an instant, in the unit of the signal.
struct ExpectedValue {
  std::int64_t time_ns = 0;
  double value = 0.0;
  double tolerance = 0.0;
  std::uint32_t line = 0;
};

/// Empty with mistakes.
std::optional<ExpectedValue> expected_value(const config::InstantCheck& check,
                                            const signals::SignalInfo& signal,
                                            config::Diagnostics& diagnostics) {
  ExpectedValue expected{.time_ns = check.time_ns, .line = check.value.place().line};
  const config::Word* const name = sole_word_of(check.value);
  const auto value =
      name != nullptr
          ? signals::value_named(signal.named_values, *name, signal.name, diagnostics)
          : check_constant(check.value, limit_kind(signal), signal.unit, "'expectation'", diagnostics);
  if (value) expected.value = *value;
  warn_of_missing_unit(check.value, signal, diagnostics);
  if (check.tolerance) {
    const auto tolerance =
        check_constant(*check.tolerance, ConstantKind::difference, signal.unit, "'tolerance'", diagnostics);
    if (!tolerance) return std::nullopt;
    expected.tolerance = *tolerance;
    if (*tolerance < 0.0) {
      diagnostics.add(check.tolerance->place(),
                      "'tolerance': " + config::in_quotes(check.tolerance->text()) + " is below 0");
    }
  } else if (name == nullptr) {
    diagnostics.add(check.value.place(), "an expectation needs its tolerance, unless it is a value name");
  }
  return value ? std::optional(expected) : std::nullopt;
}

class InstantsJudge final : public Judge {
 public:
  InstantsJudge(const Instants& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        signal_(*context.table.find(claim.signal.text)),
        info_(context.table.info(signal_)),
        coverage_({signal_}, context.table, context.arrivals, context.expectation) {
    config::Diagnostics ignored;  // check_claim has reported the mistakes, so there are none
    for (const config::InstantCheck& check : claim.checks)
      expected_.push_back(*expected_value(check, info_, ignored));
  }

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    const std::int64_t time_ns = instant.time_ns;
    judged_in_last_check_ = false;
    // A skipped tick has no value.
    while (next_ < expected_.size() && expected_[next_].time_ns < time_ns)
      ++next_;
    if (next_ == expected_.size() || expected_[next_].time_ns != time_ns) return;
    judged_in_last_check_ = true;
    const ExpectedValue& expected = expected_[next_++];
    const double value = table.value(signal_);
    const bool is_known = table.is_known(signal_) && !std::isnan(value);
    coverage_.check(table, instant, is_known);
    if (!is_known) return;
    const double margin = expected.tolerance - std::abs(value - expected.value);
    if (margin < 0.0) {
      ++failures_;
      if (!first_failure_ns_) first_failure_ns_ = time_ns;
    }
    if (worst_ != nullptr && margin >= worst_margin_) return;
    worst_ = &expected;
    worst_margin_ = margin;
    worst_value_ = value;
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    coverage_.check_unplaced(table, instant, in_gap);
  }
  bool judged_in_last_check() const noexcept override { return judged_in_last_check_; }

  report::Expectation result(const Extent& extent) const override {
    report::Expectation result = held_result(name_, coverage_, extent);
    result.covered_ticks = expected_.size();
    result.first_failure_ns = first_failure_ns_;
    const std::string instants = counted(expected_.size(), "instant", "instants");
    result.detail =
        info_.name + (failures_ > 0 ? " was wrong at " + std::to_string(failures_) + " of " + instants
                                    : " at " + instants);
    if (worst_ != nullptr) {
      const units::DifferenceUnit difference = units::difference_unit(info_.unit);
      result.margin = worst_margin_ / difference.factor;
      result.margin_unit = difference.symbol;
      result.worst_ns = worst_->time_ns;
      result.detail += ": " + text_of(worst_value_, info_.unit) + " in line " + std::to_string(worst_->line) +
                       " at " + instant_text(worst_->time_ns) + ", expected " +
                       text_of(worst_->value, info_.unit) + " within " +
                       text_of(worst_->tolerance / difference.factor, difference.symbol);
    }
    const std::string shortfall = coverage_.shortfall(result.covered_ticks);
    if (first_failure_ns_) {
      result.result = report::ExpectationResult::failed;
    } else if (!shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and " + shortfall;
    }
    return result;
  }

 private:
  static std::string text_of(double value, const std::string& unit) {
    return report::to_ascii(report::quantity_text(value, unit));
  }

  const std::string name_;
  const signals::SignalId signal_;
  const signals::SignalInfo info_;
  std::vector<ExpectedValue> expected_;
  std::size_t next_ = 0;
  Coverage coverage_;
  std::uint64_t failures_ = 0;
  std::optional<std::int64_t> first_failure_ns_;
  const ExpectedValue* worst_ = nullptr;
  double worst_margin_ = 0.0, worst_value_ = 0.0;
  bool judged_in_last_check_ = false;  ///< on the last tick
};

}  // namespace

void check_claim(const Instants& claim, const ClaimCheck& check) {
  const signals::SignalId signal = check.known.find(claim.signal, check.diagnostics);
  if (!signal.valid()) return;
  for (const config::InstantCheck& instant : claim.checks)
    expected_value(instant, check.known.table().info(signal), check.diagnostics);
}

std::unique_ptr<Judge> judge_of(const Instants& claim, const JudgeContext& context) {
  return std::make_unique<InstantsJudge>(claim, context);
}

PlotContent plot_content_of(const Instants& claim, const signals::SignalTable& table) {
  const signals::SignalId signal = *table.find(claim.signal.text);
  PlotContent content = plot_of(signal);
  config::Diagnostics ignored;  // check_claim has reported the mistakes
  for (const config::InstantCheck& check : claim.checks) {
    const auto expected = expected_value(check, table.info(signal), ignored);
    if (expected)
      content.instants.push_back({signal, expected->time_ns, expected->value, expected->tolerance});
  }
  return content;
}

}  // namespace hil::expectations
