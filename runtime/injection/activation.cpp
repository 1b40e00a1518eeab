#include "runtime/injection/activation.hpp"

#include <cmath>

#include <hil/numbers.hpp>
#include <hil/splitmix64.hpp>

namespace hil::injection {

Activation::Activation(const config::ActivationSection& section, std::uint64_t seed)
    : section_(section), random_(seed), next_begin_ns_(section.at_ns.value_or(0)) {
  spans_.reserve(max_spans);
}

std::optional<Activation> Activation::compile(const config::ActivationSection& section,
                                              const signals::KnownSignals& known, std::int64_t period_ns,
                                              std::uint64_t seed, config::Diagnostics& diagnostics) {
  Activation activation(section, seed);
  const std::size_t before = diagnostics.count();
  const auto compiled = [&](const std::optional<config::Expression>& condition,
                            const char* field) -> std::optional<signals::SignalExpression> {
    if (!condition) return std::nullopt;
    seed = modules::splitmix64(seed);
    return signals::SignalExpression::compile(*condition, known, {.truth = true, .what = field},
                                              {.period_ns = period_ns, .seed = seed}, diagnostics);
  };
  activation.when_ = compiled(section.when, "'when'");
  activation.while_ = compiled(section.active_while, "'while'");
  activation.until_ = compiled(section.until, "'until'");
  const bool is_whole = section.when.has_value() == activation.when_.has_value() &&
                        section.active_while.has_value() == activation.while_.has_value() &&
                        section.until.has_value() == activation.until_.has_value();
  if (diagnostics.count() != before || !is_whole) return std::nullopt;
  return activation;
}

bool Activation::draw() noexcept {
  if (section_.probability >= 1.0) return true;
  ++draws_;
  return random_.uniform() < section_.probability;
}

std::string Activation::lost_draws() const {
  if (draws_ == 0) return {};
  return "it was drawn " + (draws_ == 1 ? "once" : std::to_string(draws_) + " times") +
         ", with a probability of " + config::format_number(100.0 * section_.probability) + " %";
}

bool Activation::has_ended(double until, double in_while, std::int64_t time_ns) const noexcept {
  // An unknown condition is not true.
  return (section_.for_ns && time_ns - began_ns_ >= *section_.for_ns) || until == 1.0 ||
         (while_ && in_while != 1.0);
}

bool Activation::is_due(double condition, std::int64_t time_ns) noexcept {
  if (when_ || while_) return condition == 1.0 && !was_true_;
  if (time_ns < next_begin_ns_) return false;
  if (section_.every_ns) {
    next_begin_ns_ += ((time_ns - next_begin_ns_) / *section_.every_ns + 1) * *section_.every_ns;
  } else {
    next_begin_ns_ = std::numeric_limits<std::int64_t>::max();
  }
  return true;
}

Activation::Change Activation::update(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  const double until = until_ ? until_->evaluate(table, time_ns, signals::Unpublished::initial_value) : 0.0;
  double condition = 0.0;
  if (when_) condition = when_->evaluate(table, time_ns, signals::Unpublished::initial_value);
  if (while_) condition = while_->evaluate(table, time_ns, signals::Unpublished::initial_value);
  Change change = Change::none;
  if (is_active_) {
    if (has_ended(until, condition, time_ns)) {
      is_active_ = false;
      ended_active_ns_ += time_ns - began_ns_;
      const bool has_span = begins_ == spans_.size();
      if (has_span) spans_.back().end_ns = time_ns;
      change = Change::ends;
    }
  } else if (begins_ < section_.times && is_due(condition, time_ns) && draw()) {
    is_active_ = true;
    began_ns_ = time_ns;
    ++begins_;
    if (!first_begin_ns_) first_begin_ns_ = time_ns;
    if (spans_.size() < max_spans) spans_.push_back({.begin_ns = time_ns});
    change = Change::begins;
  }
  // A gap between two trues does not begin it again, but it ends and begins what is active while it is true.
  if (!std::isnan(condition) || while_) was_true_ = condition == 1.0;
  return change;
}

std::int64_t Activation::active_ns(std::int64_t end_ns) const noexcept {
  return ended_active_ns_ + (is_active_ ? end_ns - began_ns_ : 0);
}

}  // namespace hil::injection
