#pragma once
// The contract of a simulation module: inputs, outputs, and parameters with unit and range. It needs no more
// than an FMI co-simulation unit provides, so that a module can wrap one.
//
// Calls, in this order:
// - create, from the checked parameters and the task: checks them and declares the ports. Opens no world and
//   no device. `hil check` goes this far.
// - configure, on an ordinary thread: creates the entities, prepares the queries and allocates all memory of
//   the module.
// - describe, on an ordinary thread: records what a history of the run needs; ModuleType::
//   make_recorded_scanner reads it, for `hil history`.
// - step, once per release, in the tick: reads the inputs, executes transactions, writes the outputs. It
//   neither allocates nor takes a lock that blocks, and does no file or console I/O.
// - contribute, after the last tick, on an ordinary thread: adds to the report.
//
// All times are run time: 0 at the first tick. World time (rtstdb::WorldTime) has the same numbers.

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/config/expression.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/config/schema.hpp"
#include "runtime/contribution/contribution.hpp"
#include "runtime/contribution/world_record.hpp"
#include "runtime/expression/relation.hpp"
#include "runtime/modules/event_log.hpp"
#include "runtime/modules/recorded_scanner.hpp"
#include "runtime/modules/world.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::modules {

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

/// Layers in which a module finds bodies other than those named, so that one of them has to have such a body.
struct BodySearch {
  std::vector<config::Word> layers;
  std::vector<config::Word> without{};
  bool is_whole_purpose = true;  ///< false: a scan or an image without a body is a result too
};

struct Ports {
  std::vector<Port> inputs;
  std::vector<Port> outputs;
  /// Layers and bodies that the parameters name, with their places in the scenario. A body is one of
  /// world.entities or of an earlier module.
  std::vector<config::Word> layers{};
  std::vector<config::Word> bodies{};
  std::vector<BodySearch> searches{};
  /// Materials of world.materials that the parameters name, with their places.
  std::vector<config::Word> materials{};
  /// The same of world.lights.
  std::vector<config::Word> lights{};
  /// The module takes pictures, which are black in a world without light.
  bool needs_light = false;
  /// Bodies of world.entities whose motion the module writes, with their places in the scenario. A body is
  /// moved by one module.
  std::vector<config::Word> moves{};
  /// Bodies that the module creates, without the module's name: "ego" of module "traffic" is the body
  /// "traffic.ego".
  std::vector<std::string> makes{};
  /// Layers of those bodies, with their places. A scenario that lists no layers has these.
  std::vector<config::Word> layers_of_made{};
  /// Shapes of those bodies, by their keys for World::shared_geometry; a key may occur more than once.
  std::vector<std::string> shapes{};
};

/// Thrown by configure: the scenario can not be set up, for example because the database refuses an entity. A
/// sentence for the user that names the module.
class SetupError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  /// The database refused a call of `caller`, as "module scanner".
  SetupError(const std::string& caller, const rtstdb::Error& error)
      : std::runtime_error(caller + ": " + error.message), code_(error.code) {}

  /// bad_input or capacity: the fault is in the scenario.
  rtstdb::ErrorCode code() const noexcept { return code_; }

 private:
  rtstdb::ErrorCode code_ = rtstdb::ErrorCode::bad_input;
};

/// The value names of a signal that an input reads.
struct ValueNames {
  std::map<std::string, double> values{};  ///< NaN: several values have the name
  std::string unit{};                      ///< of the values
  /// The bus or module of the signal has a mistake, so any name is accepted.
  bool accepts_any_name = false;
};

/// The relations of bodies that expressions of the scenario read, and the regions and beams of the world.
struct Relations {
  std::vector<expression::Relation> all;
  std::vector<config::WorldRegion> regions;
  std::vector<config::WorldBeam> beams;
};

/// The properties of the task that steps a module.
struct TaskParameters {
  std::string instance;  ///< the module's name in the scenario
  std::int64_t period_ns = 0;
  std::int64_t offset_ns = 0;    ///< run time of the first release
  std::int64_t deadline_ns = 0;  ///< from the release
  std::uint64_t seed = 0;        ///< of the run; a module derives its seed from it and the instance's name
  /// The step runs on a task thread: its outputs become visible at the deadline, and it reads the version of
  /// the release (StepContext::version), whatever is committed while it runs.
  bool own_thread = false;
  bool firm = false;  ///< see StepContext::read_class
  /// From the release until the outputs of the step are visible.
  std::int64_t visible_after_ns() const noexcept { return own_thread ? deadline_ns : 0; }
  /// By input name; filled in only for create().
  std::map<std::string, ValueNames> value_names = {};
  /// The outputs of a module whose type computes relations; filled in only for create().
  Relations relations = {};
};

/// One step. Valid only during step().
class StepContext {
 public:
  std::uint64_t run = 0;     ///< index of this run, from 0
  std::int64_t time_ns = 0;  ///< run time of the release
  std::int64_t period_ns = 0;
  /// The release's deadline on the database's clock: for the terms of transactions.
  rtstdb::ClockTime deadline{};
  /// For the terms of transactions that only read. soft: a late result is used; firm: it is discarded.
  rtstdb::DeadlineClass read_class = rtstdb::DeadlineClass::soft;
  /// The world's latest version at the release.
  rtstdb::Version version = 0;
  /// By port, in the order of Ports::inputs. An input without a signal has its `initial` and is not fresh.
  /// One whose signal is unknown (NaN) keeps its value and is not fresh.
  std::span<const signals::SignalValue> inputs;
  /// By port, in the order of Ports::outputs; contains the values of the last run. NaN: the value is unknown.
  std::span<double> outputs;
  EventLog* events = nullptr;

  rtstdb::WorldTime world_time() const noexcept { return rtstdb::world_time_ns(time_ns); }
  /// Executes the transaction, whose deadline is that of the release, and adds the time that the step waits
  /// for it to blocked_ns. Of a transaction that failed only a missed deadline has such a time.
  const rtstdb::Outcome& execute(rtstdb::Database& database, rtstdb::Transaction& transaction) noexcept;

  std::int64_t blocked_ns = 0;
  std::int64_t gpu_ns = 0;
  /// The status of the first transaction of this step that failed; idle: none failed.
  rtstdb::Status failure = rtstdb::Status::idle;
  /// A firm transaction of this step missed its deadline, or admission refused it.
  bool discarded = false;
  /// Of this step's hard transactions that were late, the latest one.
  struct HardMiss {
    std::int64_t lateness_ns = 0;  ///< 0: there is none
    const char* cause = "";        ///< what took most of the time, as "waited for other transactions"
  };
  HardMiss hard_miss{};
};

class Module {
 public:
  virtual ~Module() = default;
  virtual const Ports& ports() const noexcept = 0;
  /// Throws SetupError.
  virtual void configure(World& world, EventLog& events, const TaskParameters& task) = 0;
  virtual void step(StepContext& context) noexcept = 0;
  /// Adds what a history of the run needs to know of this module. After configure.
  virtual void describe(std::vector<contribution::ModuleRecord>& records) const { (void)records; }
  /// Adds to the report of the run: events, shapes and tracks of the map, sections. After the last tick.
  virtual void contribute(contribution::Contribution& report) const { (void)report; }
};

/// A type of module, as `type:` names it in a scenario.
struct ModuleType {
  std::string name;
  std::string about;          ///< one sentence for the documentation
  config::Schema parameters;  ///< a record
  /// Its modules use the database. False: configure gets a World that may have none.
  bool needs_world = true;
  /// Its modules write to the world, so that their transactions can not be firm.
  bool writes = false;
  /// Its module computes the relations of bodies that expressions read: it has an output for each, in their
  /// order. One type has this; a run has at most one such module.
  bool computes_relations = false;
  /// Adds a mistake, with its place, for each parameter that the schema permits but the module, or its task,
  /// does not. Returns null with mistakes when the ports are not known.
  std::unique_ptr<Module> (*create)(const config::Value& parameters, const TaskParameters& task,
                                    config::Diagnostics& diagnostics);
  /// The key of world.json whose list holds the records that make_recorded_scanner reads; empty: none.
  std::string recorded_list{};
  /// Makes the scanner of a run that is over, from a record of Module::describe. Throws RecordError.
  std::unique_ptr<RecordedScanner> (*make_recorded_scanner)(const contribution::ModuleRecord& record) =
      nullptr;
};

/// All module types of the program (table.def), by name.
const std::vector<ModuleType>& module_types();
const ModuleType* find_module_type(const std::string& name);

}  // namespace hil::modules
