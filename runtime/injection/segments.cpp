#include "runtime/injection/segments.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <hil/numbers.hpp>
#include <hil/splitmix64.hpp>

#include "runtime/signals/value_names.hpp"

namespace hil::injection {
namespace {

using SegmentKind = config::StimulusSegment::Kind;

constexpr std::int64_t without_end = std::numeric_limits<std::int64_t>::max();

/// The share of a period that has passed.
double phase_of(std::int64_t passed_ns, std::int64_t period_ns) noexcept {
  return static_cast<double>(passed_ns % period_ns) / static_cast<double>(period_ns);
}

}  // namespace

std::optional<Segments> Segments::compile(std::span<const config::StimulusSegment> segments,
                                          std::uint64_t repeat, const signals::KnownSignals& known,
                                          const signals::SignalInfo& driven, std::int64_t period_ns,
                                          std::uint64_t seed, config::Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.count();
  Segments result(repeat, seed);
  const std::string &unit = driven.unit, what = "'" + driven.name + "'";
  const units::DifferenceUnit difference = units::difference_unit(unit);
  for (const config::StimulusSegment& section : segments) {
    Segment segment{.kind = section.kind,
                    .expressions = {},
                    .period_ns = section.period_ns,
                    .share = section.share,
                    .for_ns = section.for_ns.value_or(without_end)};
    for (std::size_t i = 0; i < section.values.size(); ++i) {
      expression::ResultSpec spec{.unit = unit, .what = what};
      if (i == 1 && (section.kind == SegmentKind::sine || section.kind == SegmentKind::noise)) {
        spec.unit = difference.symbol;
        spec.is_difference = true;
        segment.second_factor = difference.factor;
      }
      seed = modules::splitmix64(seed);
      const auto value =
          signals::with_named_values(section.values[i], driven.named_values, driven.name, known, diagnostics);
      if (!value) return std::nullopt;
      auto compiled = signals::SignalExpression::compile(*value, known, spec,
                                                         {.period_ns = period_ns, .seed = seed}, diagnostics);
      if (!compiled) return std::nullopt;
      const auto constant = compiled->constant();
      if (i == 1 && section.kind == SegmentKind::noise && constant && *constant < 0.0) {
        diagnostics.add(section.values[i].place(),
                        what + ": the standard deviation is " + config::format_number(*constant) +
                            (spec.unit->empty() ? "" : " " + *spec.unit) + "; it has to be 0 or above");
      }
      segment.expressions.push_back(std::move(*compiled));
    }
    result.segments_.push_back(std::move(segment));
  }
  if (diagnostics.count() != before) return std::nullopt;
  return result;
}

void Segments::begin(double value, std::int64_t time_ns) noexcept {
  index_ = 0;
  round_ = 0;
  begin_ns_ = time_ns;
  last_ = value;
  is_over_ = false;
  is_entered_ = false;
}

void Segments::enter(std::size_t index, double value, std::int64_t time_ns,
                     const signals::SignalTable& table) noexcept {
  index_ = index;
  began_ = index;
  is_entered_ = true;
  first_ = value;
  begin_ns_ = time_ns;
  Segment& segment = segments_[index];
  a_ = segment.expressions[0].evaluate(table, time_ns, signals::Unpublished::initial_value);
  b_ = segment.expressions.size() < 2
           ? 0.0
           : segment.expressions[1].evaluate(table, time_ns, signals::Unpublished::initial_value) *
                 segment.second_factor;
}

/// Of the part that has begun.
double Segments::shape(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  Segment& segment = segments_[index_];
  const std::int64_t passed_ns = time_ns - begin_ns_;
  switch (segment.kind) {
    case SegmentKind::hold:
      return a_;
    case SegmentKind::value:
      return passed_ns == 0
                 ? a_
                 : segment.expressions[0].evaluate(table, time_ns, signals::Unpublished::initial_value);
    case SegmentKind::ramp:
      return first_ + (a_ - first_) * static_cast<double>(passed_ns) / static_cast<double>(segment.for_ns);
    case SegmentKind::sine:
      return a_ +
             b_ * std::sin(2.0 * std::numbers::pi * (phase_of(passed_ns, segment.period_ns) + segment.share));
    case SegmentKind::sawtooth:
      return a_ + (b_ - a_) * phase_of(passed_ns, segment.period_ns);
    case SegmentKind::pulses:
      return phase_of(passed_ns, segment.period_ns) < segment.share ? b_ : a_;
    case SegmentKind::noise:
      return a_ + b_ * random_.normal();
  }
  return a_;
}

double Segments::value(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  began_.reset();
  if (is_over_) return last_;
  if (!is_entered_) enter(0, last_, begin_ns_, table);
  // A part ends at its exact instant, also between ticks, where the next one begins.
  while (segments_[index_].for_ns != without_end && time_ns - begin_ns_ >= segments_[index_].for_ns) {
    const std::int64_t end_ns = begin_ns_ + segments_[index_].for_ns;
    const double at_end = segments_[index_].kind == SegmentKind::ramp ? a_ : last_;
    std::size_t next = index_ + 1;
    if (next == segments_.size()) {
      ++round_;
      if (repeat_ != 0 && round_ == repeat_) {
        is_over_ = true;
        return last_ = at_end;
      }
      next = 0;
    }
    enter(next, at_end, end_ns, table);
  }
  return last_ = shape(table, time_ns);
}

}  // namespace hil::injection
