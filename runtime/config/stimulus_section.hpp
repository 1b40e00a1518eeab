#pragma once
// The section `stimuli` of a scenario.
//
// Threads: immutable once loaded.

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/activation_section.hpp"
#include "runtime/config/expression.hpp"

namespace hil::config {

/// A part of a stimulus. A part without a duration lasts to the end of the run.
struct StimulusSegment {
  enum class Kind : std::uint8_t { hold, value, ramp, sine, sawtooth, pulses, noise };
  std::string name;  ///< empty: its begin is no event
  Kind kind = Kind::hold;
  Place place;
  /// hold, value: the value; ramp: the last value; sine: mean, amplitude; sawtooth and pulses: low, high;
  /// noise: mean, deviation.
  std::vector<Expression> values;
  std::int64_t period_ns = 0;  ///< sine, sawtooth, pulses
  double share = 0.0;          ///< sine: the phase in turns; pulses: how much of a period is high
  std::optional<std::int64_t> for_ns;
};

/// A column of a CSV file over time.
struct StimulusFile {
  std::string path;  ///< absolute
  Place place;
  Word column;
  bool is_linear = true;  ///< between rows; else the value of the row before
};

struct StimulusSection {
  Word name;
  Word drives;  ///< an input of a module, or an output of a bus
  std::variant<std::vector<StimulusSegment>, StimulusFile> profile{};
  std::uint64_t repeat = 1;  ///< of the segments; 0: to the end of the run
  ActivationSection activation{};
  std::string test_table{};  ///< name of the test table that defines it; empty: the scenario does
};

struct Scenario;
struct ReaderContext;

Schema stimuli_schema();
/// Adds the entries without mistakes.
void read_stimuli(const Value& root, Scenario& scenario, ReaderContext& reading);

}  // namespace hil::config
