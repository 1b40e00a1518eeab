#pragma once
// The contract of a simulation module: inputs, outputs, and parameters with unit and range. It needs no more
// than an FMI co-simulation unit provides, so that a module can wrap one. A module that reads or changes the
// world of a run is a WorldModule (hil/world/world_module.hpp).
//
// Calls, in this order:
// - create, from the checked parameters and the task: checks them and declares the ports. Opens no world and
//   no device. `hil check` goes this far.
// - configure, on an ordinary thread: allocates all memory of the module.
// - step, once per release, in the tick: reads the inputs and writes the outputs. It neither allocates nor
//   takes a lock that blocks, and does no file or console I/O.
// - contribute, after the last tick, on an ordinary thread: adds to the report.
//
// All times are run time: 0 at the first tick.

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <hil/contribution.hpp>
#include <hil/event_log.hpp>
#include <hil/file_stream.hpp>
#include <hil/record.hpp>
#include <hil/schema.hpp>
#include <hil/signal_value.hpp>
#include <hil/unit.hpp>

namespace hil::modules {

class Module;
class RecordedScanner;
class WorldModule;
struct Relations;

/// A scalar that a module reads or writes. The signal of output `out` of module `m` has the name "m.out".
struct Port {
  std::string name;       ///< unique among the module's inputs, or its outputs; may contain dots
  std::string unit;       ///< SI symbol, "" when dimensionless
  std::string about;      ///< one sentence for the documentation
  double initial = 0.0;   ///< value of an output before the first step, or of an input without a signal
  bool required = false;  ///< input: a scenario that does not connect it is refused
  std::map<std::string, double> named_values = {};          ///< output: value names, for expressions
  units::ValueKind value_kind = units::ValueKind::as_unit;  ///< of an output's values
};

struct Ports {
  std::vector<Port> inputs;
  std::vector<Port> outputs;
};

/// Thrown by configure: the run can not be set up. A sentence for the user that names the module.
class SetupError : public std::runtime_error {
 public:
  enum class Fault : std::uint8_t {
    scenario,  ///< a value of the scenario is not possible
    memory,    ///< there is too little
    file,      ///< a file can not be read or written
    device,    ///< there is no GPU
  };
  explicit SetupError(const std::string& sentence, Fault fault = Fault::scenario)
      : std::runtime_error(sentence), fault_(fault) {}
  Fault fault() const noexcept { return fault_; }

 private:
  Fault fault_;
};

/// The value names of a signal that an input reads.
struct ValueNames {
  std::map<std::string, double> values{};  ///< NaN: several values have the name
  std::string unit{};                      ///< of the values
  /// The bus or module of the signal has a mistake, so any name is accepted.
  bool accepts_any_name = false;
};

/// The properties of the task that steps a module.
struct TaskParameters {
  std::string instance;  ///< the module's name in the scenario
  std::int64_t period_ns = 0;
  std::int64_t tick_ns = 0;      ///< the period of the run's base rate
  std::int64_t offset_ns = 0;    ///< run time of the first release
  std::int64_t deadline_ns = 0;  ///< from the release
  std::uint64_t seed = 0;        ///< of the run; a module derives its seed from it and the instance's name
  /// The step runs on a task thread: its outputs become visible at the deadline, and it reads the version of
  /// the release (WorldStep::version), whatever is committed while it runs.
  bool own_thread = false;
  bool firm = false;  ///< see WorldStep::read_class
  /// From the release until the outputs of the step are visible.
  std::int64_t visible_after_ns() const noexcept { return own_thread ? deadline_ns : 0; }
  /// By input name; filled in only for create().
  std::map<std::string, ValueNames> value_names = {};
  /// The outputs of a module whose type computes relations (hil/world/relation.hpp); of others, and outside
  /// of create(), null.
  const Relations* relations = nullptr;
};

/// What a run gives a module. The task's parameters are valid during configure; the rest outlives the module.
struct Setup {
  const TaskParameters& task;
  EventLog& events;
  FileStreams& files;
};

/// One step. Valid only during step().
struct StepContext {
  std::uint64_t run = 0;     ///< index of this run, from 0
  std::int64_t time_ns = 0;  ///< run time of the release
  std::int64_t period_ns = 0;
  /// By port, in the order of Ports::inputs. An input without a signal has its `initial` and is not fresh.
  /// One whose signal is unknown (NaN) keeps its value and is not fresh.
  std::span<const signals::SignalValue> inputs;
  /// By port, in the order of Ports::outputs; contains the values of the last run. NaN: the value is unknown.
  std::span<double> outputs;
  EventLog* events = nullptr;
  /// The part of this step in which it waited for something else: the module adds to it.
  std::int64_t blocked_ns = 0;
};

/// What a Module and a WorldModule have in common.
class AnyModule {
 public:
  virtual ~AnyModule() = default;
  virtual const Ports& ports() const noexcept = 0;
  /// Adds to the report of the run: events, shapes and tracks of the map, sections. After the last tick.
  virtual void contribute(contribution::Contribution& report) const { static_cast<void>(report); }
  /// One of the two is not null.
  virtual Module* plain_module() noexcept { return nullptr; }
  virtual WorldModule* world_module() noexcept { return nullptr; }
};

class Module : public AnyModule {
 public:
  /// Throws SetupError.
  virtual void configure(const Setup& setup) = 0;
  virtual void step(StepContext& context) = 0;
  Module* plain_module() noexcept final { return this; }
};

/// A type of module, as `type:` names it in a scenario.
struct ModuleType {
  std::string name;
  std::string about;          ///< one sentence for the documentation
  config::Schema parameters;  ///< a record
  /// Its modules write to the world, so that their transactions can not be firm.
  bool writes = false;
  /// Adds a mistake, with its place, for each parameter that the schema permits but the module, or its task,
  /// does not. Returns null with mistakes when the ports are not known.
  std::unique_ptr<AnyModule> (*create)(const config::Value& parameters, const TaskParameters& task,
                                       config::Diagnostics& diagnostics);
  /// The functions of expressions whose values its module computes (hil/world/relation.hpp). A run has at
  /// most one such module, and adds it where the scenario has none.
  std::vector<std::string> computes{};
  /// The key of world.json whose list holds the records that make_recorded_scanner reads; empty: none.
  std::string recorded_list{};
  /// Makes the scanner of a run that is over (hil/world/recorded_scanner.hpp), from a record of
  /// WorldModule::describe. Throws RecordError.
  std::unique_ptr<RecordedScanner> (*make_recorded_scanner)(const contribution::ModuleRecord& record) =
      nullptr;
};

}  // namespace hil::modules
