#include "runtime/expectations/tracks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <hil/quantity.hpp>
#include <hil/unit.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/expectations/signal_constant.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

class TracksJudge final : public Judge {
 public:
  TracksJudge(const Tracks& claim, const JudgeContext& context)
      : name_(context.expectation.name),
        subject_(claim.signal.text),
        signal_(*context.table.find(claim.signal.text)),
        unit_(context.table.info(signal_).unit),
        difference_(units::difference_unit(unit_)),
        tolerance_(constant_value(claim.tolerance, ConstantKind::difference, unit_)),
        period_ns_(context.options.period_ns),
        shift_ticks_(claim.max_shift_ns / period_ns_),
        begin_ns_(claim.reference->begin_ns() + shift_ticks_ * period_ns_),
        end_ns_(claim.reference->end_ns() - shift_ticks_ * period_ns_),
        at_least_(claim.at_least),
        reference_(*claim.reference),
        coverage_({signal_}, context.table, context.arrivals, context.expectation),
        values_(static_cast<std::size_t>(2 * shift_ticks_ + 1)),
        fits_(values_.size()) {
    reference_.rewind();
  }

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    const std::int64_t time_ns = instant.time_ns;
    if (instant.is_tick) advance(time_ns);
    if (time_ns < begin_ns_ || time_ns > end_ns_) return;
    const double value = table.value(signal_);
    const bool is_known = table.is_known(signal_) && !std::isnan(value);
    coverage_.check(table, instant, is_known);
    if (!is_known) return;
    if (instant.is_tick) {
      if (!first_compared_ns_) first_compared_ns_ = time_ns;
      last_compared_ns_ = time_ns;
    }
    for (std::int64_t shift = -shift_ticks_; shift <= shift_ticks_; ++shift) {
      Fit& fit = fits_[static_cast<std::size_t>(shift + shift_ticks_)];
      const double expected = instant.is_tick ? values_[place_of(tick_ - shift)]
                                              : reference_.value_at(time_ns - shift * period_ns_);
      const double error = std::abs(value - expected);
      if (error > tolerance_ && !fit.first_failure_ns) fit.first_failure_ns = time_ns;
      if (error <= fit.worst_error) continue;
      fit.worst_error = error;
      fit.worst_ns = time_ns;
    }
  }
  void skip(const signals::SignalTable& /*table*/, signals::Instant instant) noexcept override {
    if (instant.is_tick) advance(instant.time_ns);
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override {
    if (instant.is_tick) advance(instant.time_ns);
    if (instant.time_ns >= begin_ns_ && instant.time_ns <= end_ns_)
      coverage_.check_unplaced(table, instant, in_gap);
  }

  report::Expectation result(const Extent& extent) const override {
    report::Expectation result = held_result(name_, coverage_, extent);
    result.covered_ticks = covered_ticks(extent);
    result.detail = subject_ + " tracks its reference within " + text_of(tolerance_) + ": ";
    if (result.covered_ticks == 0 || result.evaluated_ticks == 0) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += result.covered_ticks == 0 ? "the reference has no value on a tick that is judged"
                                                 : "the signal was known on none of its ticks";
      return result;
    }
    std::int64_t best = 0;
    for (std::int64_t shift = 1; shift <= shift_ticks_; ++shift) {
      for (const std::int64_t signed_shift : {shift, -shift})
        if (fit_at(signed_shift).worst_error < fit_at(best).worst_error) best = signed_shift;
    }
    const Fit& fit = fit_at(best);
    result.detail += "greatest error " + text_of(fit.worst_error) + " at " + instant_text(fit.worst_ns);
    if (shift_ticks_ > 0) result.detail += ", after a shift of " + config::format_duration(best * period_ns_);
    result.detail += "; " + compared(result.evaluated_ticks);
    result.margin = (tolerance_ - fit.worst_error) / difference_.factor;
    result.margin_unit = difference_.symbol;
    result.worst_ns = fit.worst_ns;
    result.first_failure_ns = fit.first_failure_ns;
    result.shift_ns = best * period_ns_;
    const std::string shortfall = coverage_.shortfall(result.covered_ticks);
    if (fit.first_failure_ns) {
      result.result = report::ExpectationResult::failed;
    } else if (!shortfall.empty()) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and " + shortfall;
    } else if (result.evaluated_ticks < at_least_) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += "; at least " + std::to_string(at_least_) + " are required (at_least)";
    }
    return result;
  }

 private:
  std::string compared(std::uint64_t instants) const {
    if (instants == 1) return "1 instant was compared, at " + duration_text(*first_compared_ns_);
    return std::to_string(instants) + " instants were compared, from " + duration_text(*first_compared_ns_) +
           " to " + duration_text(last_compared_ns_);
  }

  /// The comparison with one shift.
  struct Fit {
    double worst_error = -1.0;
    std::int64_t worst_ns = 0;
    std::optional<std::int64_t> first_failure_ns{};
  };
  const Fit& fit_at(std::int64_t shift) const {
    return fits_[static_cast<std::size_t>(shift + shift_ticks_)];
  }
  std::size_t place_of(std::int64_t tick) const noexcept {
    const auto size = static_cast<std::int64_t>(values_.size());
    return static_cast<std::size_t>(((tick % size) + size) % size);
  }
  /// The values of the reference from shift_ticks_ before to shift_ticks_ after this tick.
  void advance(std::int64_t time_ns) noexcept {
    tick_ = time_ns / period_ns_;
    next_ = std::max(next_.value_or(tick_ - shift_ticks_), tick_ - shift_ticks_);
    for (; *next_ <= tick_ + shift_ticks_; ++*next_)
      values_[place_of(*next_)] = reference_.at(*next_ * period_ns_);
  }
  std::uint64_t covered_ticks(const Extent& extent) const {
    const auto first_at = [&](std::int64_t time_ns) {  // the first tick at this time or later
      return time_ns <= 0 ? 0 : (time_ns + period_ns_ - 1) / period_ns_;
    };
    const std::int64_t begin = std::max(first_at(begin_ns_), first_at(extent.begin_ns));
    const std::int64_t end =
        std::min(end_ns_ < 0 ? 0 : first_at(end_ns_ + 1),
                 first_at(extent.begin_ns) + static_cast<std::int64_t>(extent.ticks - extent.ticks_before));
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, end - begin)) + extent.ticks_before;
  }
  std::string text_of(double difference) const {
    return report::to_ascii(report::quantity_text(difference / difference_.factor, difference_.symbol));
  }

  const std::string name_, subject_;
  const signals::SignalId signal_;
  const std::string unit_;
  const units::DifferenceUnit difference_;
  const double tolerance_;
  const std::int64_t period_ns_, shift_ticks_;
  const std::int64_t begin_ns_, end_ns_;  ///< of what is judged
  const std::uint64_t at_least_;
  signals::CsvProfile reference_;
  Coverage coverage_;
  std::vector<double> values_;  ///< of the reference, a ring by tick
  std::vector<Fit> fits_;       ///< by shift
  std::optional<std::int64_t> first_compared_ns_;
  std::int64_t last_compared_ns_ = 0;
  std::int64_t tick_ = 0;
  std::optional<std::int64_t> next_;  ///< the tick whose value comes next
};

config::Schema tracks_schema(std::span<const config::BusSectionType> /*buses*/) {
  using config::Field;
  using config::Schema;
  return Schema::record({
      Field::needed("signal", Schema::signal(), "The signal that follows the reference."),
      Field::needed("reference", Schema::file(),
                    "A CSV file: a column 'time' in seconds, and one with the values, in the signal's unit."),
      Field::optional("column", Schema::text(), "The column with the values. Left out: the only one."),
      Field::needed("tolerance", Schema::text(), "The largest error, with its unit."),
      Field::optional("after_shift", config::duration_schema(0.0),
                      "The longest time by which the signal may be later or earlier than the reference, "
                      "always the same. Left out: none."),
      Field::with_default(
          "at_least", Schema::integer(2, 1'000'000'000), "20",
          "The least number of instants that have to be compared. With fewer, the expectation "
          "is not checked."),
  });
}

std::shared_ptr<const config::Claim> read_tracks(const config::Value& entry,
                                                 const config::ClaimContext& context) {
  const config::Value& value = entry["tracks"];
  auto tolerance = config::Expression::parse(value["tolerance"], context.diagnostics);
  const config::Place& place = value["reference"].place();
  const config::Word column =
      value.has("column") ? config::word_of(value["column"]) : config::Word{"", place};
  auto reference =
      signals::CsvProfile::read(value["reference"].text(), place, column, true, context.diagnostics);
  std::int64_t shift_ns = 0;
  if (value.has("after_shift")) {
    shift_ns = value["after_shift"].duration_ns();
    if (context.period_ns > 0 && shift_ns / context.period_ns > max_shift_ticks) {
      context.diagnostics.add(value["after_shift"].place(),
                              "'after_shift': " + config::format_duration(shift_ns) + " is more than " +
                                  std::to_string(max_shift_ticks) + " base periods, " +
                                  config::format_duration(max_shift_ticks * context.period_ns));
    }
  }
  if (!tolerance || !reference) return nullptr;
  return claim_of(Tracks{
      config::word_of(value["signal"]), std::make_shared<const signals::CsvProfile>(std::move(*reference)),
      place, std::move(*tolerance), shift_ns, static_cast<std::uint64_t>(value["at_least"].integer())});
}

}  // namespace

void check_claim(const Tracks& claim, const ClaimCheck& check) {
  const signals::SignalId signal = check.known.find(claim.signal, check.diagnostics);
  if (signal.valid()) {
    const auto tolerance =
        check_constant(claim.tolerance, ConstantKind::difference, check.known.table().info(signal).unit,
                       "'tolerance'", check.diagnostics);
    warn_of_missing_unit(claim.tolerance, check.known.table().info(signal), check.diagnostics);
    if (tolerance && *tolerance <= 0.0) {
      check.diagnostics.add(claim.tolerance.place(),
                            "'tolerance': " + config::in_quotes(claim.tolerance.text()) + " is not above 0");
    }
  }
  const std::int64_t begin_ns = claim.reference->begin_ns() + claim.max_shift_ns;
  const std::int64_t end_ns = claim.reference->end_ns() - claim.max_shift_ns;
  if (begin_ns > end_ns || end_ns < 0 || (check.duration_ns > 0 && begin_ns >= check.duration_ns)) {
    check.diagnostics.add(claim.reference_place,
                          "the reference lasts from " + config::format_duration(claim.reference->begin_ns()) +
                              " to " + config::format_duration(claim.reference->end_ns()) +
                              (claim.max_shift_ns > 0 ? ", which leaves no tick of the run after the shift"
                                                      : ", which is no tick of the run"));
  }
}

std::vector<signals::SignalId> judged_arrivals_of(const Tracks& claim, const signals::SignalTable& table) {
  return {*table.find(claim.signal.text)};
}
std::unique_ptr<Judge> judge_of(const Tracks& claim, const JudgeContext& context) {
  return std::make_unique<TracksJudge>(claim, context);
}
PlotContent plot_content_of(const Tracks& claim, const signals::SignalTable& table) {
  const signals::SignalId signal = *table.find(claim.signal.text);
  PlotContent content = plot_of(signal);
  content.reference = {signal, *claim.reference,
                       constant_value(claim.tolerance, ConstantKind::difference, table.info(signal).unit)};
  return content;
}

config::ExpectationKind tracks_kind() {
  return {.key = "tracks",
          .about = "A signal that follows a reference curve within a tolerance.",
          .schema = tracks_schema,
          .read = read_tracks};
}

}  // namespace hil::expectations
