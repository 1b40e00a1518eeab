#pragma once
// The value of a stimulus over time, as a sequence of parts.
//
// Threads: compile on the one that wires the run; begin and value on the base thread, without allocation.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/config/stimulus_section.hpp"
#include "runtime/injection/random_numbers.hpp"
#include "runtime/injection/waveform.hpp"

namespace hil::injection {

class Segments {
 public:
  /// Empty with mistakes. `driven`: the signal that gets the values.
  static std::optional<Segments> compile(std::span<const config::StimulusSegment> segments,
                                         std::uint64_t repeat, const signals::KnownSignals& known,
                                         const signals::SignalInfo& driven, std::int64_t period_ns,
                                         std::uint64_t seed, config::Diagnostics& diagnostics);

  /// The sequence begins. `value`: before it, where a ramp in the first part begins.
  void begin(double value, std::int64_t time_ns) noexcept;
  /// In each tick from the begin on. After the end it stays at the last value.
  double value(const signals::SignalTable& table, std::int64_t time_ns) noexcept;
  /// The index of the part that began in the last call of value(), if one did.
  std::optional<std::size_t> began() const noexcept { return began_; }
  bool is_over() const noexcept { return is_over_; }
  /// The index of the part to which the last value belongs.
  std::size_t part() const noexcept { return index_; }

 private:
  Segments(std::uint64_t repeat, std::uint64_t seed) : repeat_(repeat), random_(seed) {}

  struct Segment {
    std::shared_ptr<const Waveform> waveform;
    std::vector<WaveformExpression> expressions;
    std::vector<double> values;  ///< of the expressions, when the part began
    std::int64_t for_ns = 0;     ///< the largest number: to the end of the run
  };

  WaveformInstant instant(const signals::SignalTable& table, std::int64_t time_ns) noexcept;
  void enter(std::size_t index, double value, std::int64_t time_ns,
             const signals::SignalTable& table) noexcept;

  std::vector<Segment> segments_;
  std::uint64_t repeat_;  ///< 0: without end
  RandomNumbers random_;

  std::size_t index_ = 0;
  std::uint64_t round_ = 0;
  std::int64_t begin_ns_ = 0;  ///< of the part
  double before_ = 0.0;        ///< the value before the part
  double last_ = 0.0;
  bool is_entered_ = false;
  bool is_over_ = false;
  std::optional<std::size_t> began_;
};

}  // namespace hil::injection
