#pragma once
// The section `stimuli` of a scenario, and the port between a scenario and a kind of part of a stimulus.
// What a kind does is read by the kind itself (runtime/injection), so that this folder names none.
//
// Threads: immutable once loaded.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/activation_section.hpp"
#include "runtime/config/expression.hpp"

namespace hil::config {

/// The values of a part of a stimulus over time. A kind of part derives its own from it.
class Waveform {
 public:
  virtual ~Waveform() = default;
  /// The expressions that it reads.
  virtual std::vector<Expression> expressions() const = 0;
};

/// What a reader of a waveform knows besides its value.
struct WaveformContext {
  std::int64_t period_ns = 0;  ///< of the base tick; 0: it has a mistake
  Diagnostics& diagnostics;
};

/// A kind of part of a stimulus: the key that a part has exactly one of.
struct WaveformKind {
  std::string key;
  std::string about;
  bool needs_duration = false;  ///< a part of this kind can not last to the end of the run
  Schema (*schema)() = nullptr;
  /// Of the value under the key. What it returns with mistakes is not used.
  std::shared_ptr<const Waveform> (*read)(const Value& value, const WaveformContext& context) = nullptr;
};

/// What a scenario knows of waveforms.
struct Waveforms {
  std::span<const WaveformKind> kinds{};
  /// The waveform of values in test tables: holds the value of the expression.
  std::shared_ptr<const Waveform> (*held)(Expression value) = nullptr;
};

/// A part of a stimulus. A part without a duration lasts to the end of the run.
struct StimulusSegment {
  std::string name;  ///< empty: its begin is no event
  Place place;
  std::shared_ptr<const Waveform> waveform;
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

Schema stimuli_schema(const Waveforms& waveforms);
/// Adds the entries without mistakes.
void read_stimuli(const Value& root, Scenario& scenario, ReaderContext& reading);

}  // namespace hil::config
