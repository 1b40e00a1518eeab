#include "runtime/injection/segments.hpp"

#include <limits>
#include <utility>

#include <hil/require.hpp>

namespace hil::injection {
namespace {

constexpr std::int64_t without_end = std::numeric_limits<std::int64_t>::max();

}  // namespace

std::optional<Segments> Segments::compile(std::span<const config::StimulusSegment> segments,
                                          std::uint64_t repeat, const signals::KnownSignals& known,
                                          const signals::SignalInfo& driven, std::int64_t period_ns,
                                          std::uint64_t seed, config::Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.count();
  Segments result(repeat, seed);
  for (const config::StimulusSegment& section : segments) {
    Segment segment{.waveform = std::dynamic_pointer_cast<const Waveform>(section.waveform),
                    .expressions = {},
                    .values = {},
                    .for_ns = section.for_ns.value_or(without_end)};
    config::require(segment.waveform != nullptr, "a waveform of a kind in table.def");
    WaveformCompiler compiler(known, driven, period_ns, seed, diagnostics);
    if (!segment.waveform->compile(compiler)) return std::nullopt;
    segment.expressions = compiler.take();
    segment.values.resize(segment.expressions.size());
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

/// Of the part that has begun.
WaveformInstant Segments::instant(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  Segment& segment = segments_[index_];
  WaveformInstant instant(segment.expressions, table, time_ns, random_);
  instant.values = segment.values;
  instant.before = before_;
  instant.passed_ns = time_ns - begin_ns_;
  instant.for_ns = segment.for_ns;
  return instant;
}

void Segments::enter(std::size_t index, double value, std::int64_t time_ns,
                     const signals::SignalTable& table) noexcept {
  index_ = index;
  began_ = index;
  is_entered_ = true;
  before_ = value;
  begin_ns_ = time_ns;
  const WaveformInstant begin = instant(table, time_ns);
  std::vector<double>& values = segments_[index].values;
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = begin.evaluate(i);
}

double Segments::value(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  began_.reset();
  if (is_over_) return last_;
  if (!is_entered_) enter(0, last_, begin_ns_, table);
  // A part ends at its exact instant, also between ticks, where the next one begins.
  while (segments_[index_].for_ns != without_end && time_ns - begin_ns_ >= segments_[index_].for_ns) {
    const Segment& ended = segments_[index_];
    const std::int64_t end_ns = begin_ns_ + ended.for_ns;
    const double at_end = ended.waveform->at_end(last_, ended.values);
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
  return last_ = segments_[index_].waveform->value(instant(table, time_ns));
}

}  // namespace hil::injection
