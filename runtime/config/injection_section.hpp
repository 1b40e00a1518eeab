#pragma once
// The sections `stimuli` and `faults` of a scenario, and when an entry of them is active.
//
// Threads: immutable once loaded.

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "runtime/config/diagnostics.hpp"
#include "runtime/config/expression.hpp"
#include "runtime/config/schema.hpp"

namespace hil::config {

/// When something is active. It begins once without `at`, `when` and `while`: at 0.
struct ActivationSection {
  std::optional<std::int64_t> at_ns;       ///< run time of its begin
  std::optional<std::int64_t> every_ns;    ///< with at_ns: from one begin to the next
  std::optional<Expression> when;          ///< begins where it becomes true
  std::optional<Expression> active_while;  ///< active where it is true
  std::optional<std::int64_t> for_ns;
  std::optional<Expression> until;
  std::uint64_t times = 1;   ///< that it begins, at most
  double probability = 1.0;  ///< of each begin
};

/// A fault of a signal: what its readers read in place of it.
struct FaultSection {
  enum class Kind : std::uint8_t { stuck_at_last, stuck, offset, gain, noise, drift, delay, dropout };
  Word name;
  Word signal;
  Kind kind = Kind::stuck_at_last;
  std::optional<Expression> value{};  ///< of stuck, offset, gain, noise (its deviation), drift
  std::int64_t delay_ns = 0;
  double dropout = 0.0;         ///< share of the ticks
  std::vector<Word> readers{};  ///< modules, buses, inputs of them; empty: all
  ActivationSection activation{};
};

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
};

struct Scenario;
struct ReaderContext;

Schema stimuli_schema();
Schema faults_schema();
/// Adds the entries without mistakes.
void read_stimuli(const Value& root, Scenario& scenario, ReaderContext& reading);
void read_faults(const Value& root, Scenario& scenario, ReaderContext& reading);

}  // namespace hil::config
