#pragma once
// The section `faults` of a scenario, and the port between a scenario and a kind of fault. What a kind does
// is read by the kind itself (of signals: runtime/injection; of messages and devices: their type of bus; of
// processes and tasks: runtime/run), so that this folder names none.
//
// Threads: immutable once loaded; any thread may read.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <hil/schema.hpp>

#include "runtime/config/activation_section.hpp"
#include "runtime/config/expression.hpp"

namespace hil::config {

/// The longest delay of a signal, a frame or a reply: what is delayed is kept in memory.
inline constexpr double max_fault_delay_s = 60.0;

struct Scenario;
struct ReaderContext;
struct ScenarioTypes;

enum class FaultTarget : std::uint8_t {
  signal,   ///< what its readers read in place of it
  message,  ///< its frames on their way from or to the bus
  device,   ///< a bus or unit as the run sees it
  process,  ///< that the run starts
  task,
};

/// What a fault does. A kind derives its own from it.
class FaultEffect {
 public:
  virtual ~FaultEffect() = default;
  /// In words, for the report: "stuck at its last value".
  virtual std::string sentence() const = 0;
  /// The expressions that it reads.
  virtual std::vector<Expression> expressions() const { return {}; }
  /// Why it can not act in ticks of this period, as a sentence; empty: it can.
  virtual std::string period_problem(std::int64_t base_period_ns) const {
    static_cast<void>(base_period_ns);
    return {};
  }
};

struct FaultSection {
  Word name;
  FaultTarget target = FaultTarget::signal;
  Word subject{};  ///< the name of the target
  Place place{};   ///< of the effect
  std::shared_ptr<const FaultEffect> effect{};
  std::vector<Word> readers{};  ///< of a signal: modules, buses, inputs of them; empty: all
  ActivationSection activation{};
  std::string test_table{};  ///< name of the test table that defines it; empty: the scenario does
};

/// What a reader of an effect knows besides its value.
struct FaultContext {
  std::int64_t period_ns = 0;  ///< of the base tick; 0: it has a mistake
  const ActivationSection& activation;
  Diagnostics& diagnostics;
};

/// A kind of fault: the key that an entry has exactly one of, or a word that is the value of the key.
struct FaultKind {
  FaultTarget target = FaultTarget::signal;
  /// Kinds of other targets may have the same key. Its schema is that of the first one.
  std::string key;
  /// The key stands for this kind where its value is this word; empty: all its values are of this kind. All
  /// kinds of a key have words, or none has.
  std::string word{};
  /// With a word: what has it, "a Modbus unit".
  std::string subject{};
  /// A sentence on the key or the word. Without a full stop: a part of the sentence on the key, which the
  /// kinds of the key have together. With a word: the word, and perhaps more.
  std::string about;
  Schema (*schema)() = nullptr;  ///< null with a word
  /// Of the value under the key. What it returns with mistakes is not used.
  std::shared_ptr<const FaultEffect> (*read)(const Value& value, const FaultContext& context) = nullptr;

  /// Of a signal: the key with a value as the cell of a test table, "offset 2 cm"; empty: it needs no value.
  std::string cell_example{};
  /// The same for what follows the key in the cell of a test table. Null: test tables do not have it.
  std::shared_ptr<const FaultEffect> (*read_cell)(const Word& value, Diagnostics& diagnostics) = nullptr;
};

/// The share of ticks or frames under a key; a mistake where it is 0 %.
double read_fault_share(const Value& share, const std::string& key, Diagnostics& diagnostics);

Schema faults_schema(const ScenarioTypes& types);
/// Adds the entries without mistakes.
void read_faults(const Value& root, Scenario& scenario, ReaderContext& reading);

}  // namespace hil::config
