#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <hil/numbers.hpp>
#include <hil/unit.hpp>

#include "runtime/expectations/signal_constant.hpp"
#include "runtime/expectations/statistics.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

/// A figure beside one of its limits.
struct FigureLimit {
  std::string name;
  double value = 0.0, limit = 0.0;
  bool is_max = true;
  std::string unit{};
  std::optional<std::int64_t> worst_ns{};
  bool is_reached = true;  ///< false: the value only grows to its end, as the time of what has not settled
};
double distance(const FigureLimit& figure) {
  return figure.is_max ? figure.limit - figure.value : figure.value - figure.limit;
}
bool is_held(const FigureLimit& figure) {
  return figure.is_reached && distance(figure) >= 0.0;
}
/// NaN: it failed, and by how much is not known.
double margin(const FigureLimit& figure) {
  const bool is_known = figure.is_reached || distance(figure) < 0.0;
  return is_known ? distance(figure) : std::numeric_limits<double>::quiet_NaN();
}
/// As a share of the limit. Of a limit of 0: infinite, with its sign.
double relative_margin(const FigureLimit& figure) {
  if (std::isnan(margin(figure))) return -std::numeric_limits<double>::infinity();
  return margin(figure) == 0.0 ? 0.0 : margin(figure) / std::abs(figure.limit);
}

/// The step that an overshoot or a settling time belongs to, in the unit of the signal.
struct StepChange {
  double to = 0.0, from = 0.0;
  bool has_begun = false;    ///< the signal was within 10 % of the step of `from`
  bool has_reached = false;  ///< and then reached 90 % of the step

  double size() const { return to - from; }
  void note(double value) {
    const double progress = (value - from) / size();  // NaN without a step
    has_begun = has_begun || progress <= 0.1;
    has_reached = has_reached || (has_begun && progress >= 0.9);
  }
};

class StatisticsJudge final : public Judge {
 public:
  StatisticsJudge(const Statistics& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        claim_(claim),
        signal_(*context.table.find(claim.signal.text)),
        unit_(context.table.info(signal_).unit),
        limit_kind_(limit_kind(context.table.info(signal_))),
        has_rms_(has_rms(context.table.info(signal_))),
        difference_(units::difference_unit(unit_)),
        coverage_({signal_}, context.table, context.arrivals, context.expectation) {
    if (claim.overshoot) overshoot_of_ = values_of(claim.overshoot->step);
    if (claim.settling) settling_of_ = values_of(claim.settling->step);
  }

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    const std::int64_t time_ns = instant.time_ns;
    const double value = table.value(signal_);
    const bool is_known = table.is_known(signal_) && !std::isnan(value);
    coverage_.check(table, instant, is_known);
    if (!is_known) return;
    if (!has_begun_) begin(value, time_ns);
    if (instant.is_tick) {
      ++count_;
      const double from_mean = value - mean_;
      mean_ += from_mean / static_cast<double>(count_);
      squares_ += from_mean * (value - mean_);
    }
    if (value < smallest_) smallest_ = value, smallest_ns_ = time_ns;
    if (value > largest_) largest_ = value, largest_ns_ = time_ns;
    if (claim_.overshoot) {
      const double excess = (value - overshoot_of_.to) * (overshoot_of_.size() < 0.0 ? -1.0 : 1.0);
      if (excess > excess_) excess_ = excess, excess_ns_ = time_ns;
      overshoot_of_.note(value);
    }
    if (!claim_.settling) return;
    settling_of_.note(value);
    const double band = claim_.settling->within * std::abs(settling_of_.size());
    const bool is_outside = std::abs(value - settling_of_.to) > band;
    if (is_outside) settled_ns_.reset(), outside_ns_ = time_ns;
    if (!is_outside && !settled_ns_) settled_ns_ = time_ns;
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    coverage_.check_unplaced(table, instant, in_gap);
  }

  report::Expectation result(const Extent& extent) const override {
    report::Expectation result = held_result(name_, coverage_, extent);
    result.detail = "statistics of " + claim_.signal.text + ": ";
    const std::string shortfall = coverage_.shortfall(extent.ticks);
    if (count_ == 0) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += shortfall;
      return result;
    }
    const auto limited = limited_figures(extent);
    result.detail += figures_text(extent) + broken_limits(limited);
    result.figures = recorded(limited);
    const bool has_step = (!claim_.overshoot || overshoot_of_.size() != 0.0) &&
                          (!claim_.settling || settling_of_.size() != 0.0);
    const auto worst = std::ranges::min_element(limited, {}, relative_margin);
    if (worst != limited.end()) {
      result.margin = margin(*worst);
      result.margin_unit = worst->unit;
      result.worst_ns = worst->worst_ns;
    }
    if (!std::ranges::all_of(limited, is_held)) {
      result.result = report::ExpectationResult::failed;
      result.first_failure_ns = worst->worst_ns.value_or(extent.end_ns);
    } else if (!shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and " + shortfall;
    } else if (!has_step) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and the signal begins at the final value, so there is no step";
    } else if ((claim_.overshoot && !overshoot_of_.has_begun) ||
               (claim_.settling && !settling_of_.has_begun)) {
      const StepChange& step = claim_.overshoot && !overshoot_of_.has_begun ? overshoot_of_ : settling_of_;
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and the signal was never within 10 % of the step of its begin at " +
                       report::to_ascii(report::quantity_text(step.from, unit_)) + ", so it made no step";
    } else if (claim_.overshoot && !overshoot_of_.has_reached) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and the signal did not reach 90 % of the step, so it can not overshoot";
    }
    return result;
  }

 private:
  static std::string words_of(Statistics::Figure figure) {
    return figure == Statistics::standard_deviation ? "standard deviation" : key_of(figure);
  }
  /// "mean 5.2 m is above 5 m": the limits that do not hold, with value and bound in one unit.
  static std::string broken_limits(const std::vector<FigureLimit>& limited) {
    std::string text;
    for (const FigureLimit& figure : limited) {
      if (is_held(figure)) continue;
      const auto in_unit = [&](double value) {
        return config::format_number(value, 7) + (figure.unit.empty() ? "" : " " + figure.unit);
      };
      text += "; " + figure.name + " " + in_unit(figure.value) +
              (!figure.is_reached ? " at the end, and still growing; the limit is "
               : figure.is_max    ? " is above "
                                  : " is below ") +
              in_unit(figure.limit);
    }
    return text;
  }
  static std::vector<report::LimitedFigure> recorded(const std::vector<FigureLimit>& limited) {
    std::vector<report::LimitedFigure> all;
    for (const FigureLimit& figure : limited) {
      if (all.empty() || all.back().name != figure.name)
        all.push_back(
            {.name = figure.name, .value = figure.value, .unit = figure.unit, .min = {}, .max = {}});
      (figure.is_max ? all.back().max : all.back().min) = figure.limit;
      all.back().is_held = all.back().is_held && is_held(figure);
    }
    return all;
  }
  /// NaN: it begins at the value at the first instant.
  StepChange values_of(const StepResponse& step) const {
    return {constant_value(step.of, limit_kind_, unit_), step.from
                                                             ? constant_value(*step.from, limit_kind_, unit_)
                                                             : std::numeric_limits<double>::quiet_NaN()};
  }
  void begin(double value, std::int64_t time_ns) noexcept {
    has_begun_ = true;
    begin_ns_ = time_ns;
    for (StepChange* step : {&overshoot_of_, &settling_of_})
      if (std::isnan(step->from)) step->from = value;
  }
  double deviation() const { return std::sqrt(squares_ / static_cast<double>(count_)); }
  double value_of(Statistics::Figure figure) const {
    switch (figure) {
      case Statistics::mean:
        return mean_;
      case Statistics::rms:
        return std::hypot(mean_, deviation());
      case Statistics::standard_deviation:
        return deviation() / difference_.factor;
      case Statistics::smallest:
        return smallest_;
      case Statistics::largest:
        break;
    }
    return largest_;
  }
  double overshoot() const { return std::max(0.0, excess_) / std::abs(overshoot_of_.size()); }
  /// Of a signal that is outside at the end: at least to the end.
  std::int64_t settling_ns(const Extent& extent) const {
    return settled_ns_.value_or(extent.end_ns) - begin_ns_;
  }

  std::vector<FigureLimit> limited_figures(const Extent& extent) const {
    std::vector<FigureLimit> all;
    for (const auto figure : {Statistics::mean, Statistics::rms, Statistics::standard_deviation,
                              Statistics::smallest, Statistics::largest}) {
      const bool is_difference = figure == Statistics::standard_deviation;
      const auto limit = [&](const config::Expression& text) {
        return is_difference ? constant_value(text, ConstantKind::difference, unit_) / difference_.factor
                             : constant_value(text, limit_kind_, unit_);
      };
      std::optional<std::int64_t> worst_ns;
      if (figure == Statistics::smallest) worst_ns = smallest_ns_;
      if (figure == Statistics::largest) worst_ns = largest_ns_;
      const Limits& limits = claim_.limits[figure];
      const std::string& unit = is_difference ? difference_.symbol : unit_;
      if (limits.min)
        all.push_back({words_of(figure), value_of(figure), limit(*limits.min), false, unit, worst_ns});
      if (limits.max)
        all.push_back({words_of(figure), value_of(figure), limit(*limits.max), true, unit, worst_ns});
    }
    if (claim_.overshoot && overshoot_of_.size() != 0.0)
      all.push_back(
          {"overshoot", 100.0 * overshoot(), 100.0 * claim_.overshoot->at_most, true, "%", excess_ns_});
    if (claim_.settling && settling_of_.size() != 0.0) {
      const double settling_s = static_cast<double>(settling_ns(extent)) / 1e9;
      const double limit_s = static_cast<double>(claim_.settling->at_most_ns) / 1e9;
      all.push_back({"settling time", settling_s, limit_s, true, "s", outside_ns_, settled_ns_.has_value()});
    }
    return all;
  }

  std::string figures_text(const Extent& extent) const {
    std::string text;
    for (const auto figure : {Statistics::mean, Statistics::rms, Statistics::standard_deviation,
                              Statistics::smallest, Statistics::largest}) {
      if (figure == Statistics::rms && !has_rms_) continue;
      const std::string& unit = figure == Statistics::standard_deviation ? difference_.symbol : unit_;
      text += (text.empty() ? "" : ", ") + words_of(figure) + " " +
              report::to_ascii(report::quantity_text(value_of(figure), unit));
    }
    if (claim_.overshoot && overshoot_of_.size() != 0.0)
      text += ", overshoot " + report::to_ascii(report::quantity_text(100.0 * overshoot(), "%"));
    if (claim_.settling && settling_of_.size() != 0.0) {
      text +=
          settled_ns_ ? ", settling time " + duration_text(settling_ns(extent)) : ", not settled at the end";
    }
    return text;
  }

  const std::string name_;
  const Statistics claim_;
  const signals::SignalId signal_;
  const std::string unit_;
  const ConstantKind limit_kind_;
  const bool has_rms_;
  const units::DifferenceUnit difference_;
  Coverage coverage_;
  StepChange overshoot_of_, settling_of_;
  bool has_begun_ = false;             ///< there was an instant
  std::uint64_t count_ = 0;            ///< of ticks
  double mean_ = 0.0, squares_ = 0.0;  ///< the sum of squared deviations from the mean
  double smallest_ = std::numeric_limits<double>::infinity();
  double largest_ = -std::numeric_limits<double>::infinity();
  double excess_ = -std::numeric_limits<double>::infinity();
  std::int64_t begin_ns_ = 0, smallest_ns_ = 0, largest_ns_ = 0, excess_ns_ = 0;
  std::optional<std::int64_t> settled_ns_, outside_ns_;
};

}  // namespace

std::vector<signals::SignalId> judged_arrivals_of(const Statistics& claim,
                                                  const signals::SignalTable& table) {
  return {*table.find(claim.signal.text)};
}
std::unique_ptr<Judge> judge_of(const Statistics& claim, const JudgeContext& context) {
  return std::make_unique<StatisticsJudge>(claim, context);
}
/// Limits of a figure are no limits of the signal.
PlotContent plot_content_of(const Statistics& claim, const signals::SignalTable& table) {
  return plot_of(*table.find(claim.signal.text));
}

}  // namespace hil::expectations
