#pragma once
// The contract of a simulation module: configure, start, step, stop; inputs, outputs, parameters with unit
// and range. It asks for no more than an FMI co-simulation unit could give, so that one can stand behind it.
//
// Life of a module:
// - create, from its checked parameters: declares its ports. No world, no device.
// - check_task: what the parameters ask of the task. `hil check` goes this far.
// - configure, on an ordinary thread: creates its entities, prepares its queries, allocates everything
//   it will ever need.
// - step, once per release, in the tick: no allocation, no blocking lock, no file or console I/O. It reads
//   its inputs, talks to the world through transactions, writes its outputs.
// - contribute, after the last tick, on an ordinary thread: what the report shall show of it.
//
// Time is run time throughout: 0 at the first tick; the world's time (rtstdb::WorldTime) is the same number.

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/config/condition.hpp"
#include "runtime/config/schema.hpp"
#include "runtime/contribution/contribution.hpp"
#include "runtime/contribution/world_record.hpp"
#include "runtime/modules/event_log.hpp"
#include "runtime/modules/world.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::modules {

/// A scalar that a module reads or writes. The signal of output `out` of module `m` is called "m.out".
struct Port {
  std::string name;   ///< unique among the module's inputs, or its outputs; may hold dots
  std::string unit;   ///< SI symbol, "" when dimensionless
  std::string about;  ///< one sentence for the documentation
  double initial =
      0.0;  ///< output: its value before the first step. Input: what is read when it is not connected
  bool required = false;  ///< input: a scenario that leaves it unconnected is refused
};

struct Ports {
  std::vector<Port> inputs;
  std::vector<Port> outputs;
  /// What the parameters name of the scenario's world, with their places: layers, and bodies of
  /// world.entities or of modules that come earlier.
  std::vector<config::Word> layers{};
  std::vector<config::Word> bodies{};
  /// Bodies that the module makes, without its own name: "ego" of module "traffic" is the body "traffic.ego".
  std::vector<std::string> makes{};
  /// Layers of those bodies, with their places. A scenario that lists no layers has these.
  std::vector<config::Word> layers_of_made{};
  /// Shapes of those bodies, by their keys for World::shared_geometry; one may stand here more than once.
  std::vector<std::string> shapes{};
};

/// Thrown by configure: the scenario can not be set up (a mesh can not be read, the database refuses an
/// entity). A sentence for the user that names the module.
class SetupError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  /// The database refused a call of `caller`, as "module scanner".
  SetupError(const std::string& caller, const rtstdb::Error& error)
      : std::runtime_error(caller + ": " + error.message), code_(error.code) {}

  /// bad_input or capacity: the scenario is at fault.
  rtstdb::ErrorCode code() const noexcept { return code_; }

 private:
  rtstdb::ErrorCode code_ = rtstdb::ErrorCode::bad_input;
};

/// What a module needs to know about its task.
struct TaskFacts {
  std::string instance;  ///< the module's name in the scenario
  std::int64_t period_ns = 0;
  std::int64_t offset_ns = 0;    ///< run time of the first release
  std::int64_t deadline_ns = 0;  ///< from the release
  std::uint64_t seed = 0;        ///< of the run; derive your own from it and the instance's name
  /// The step runs on a thread of its own: others see its outputs at the deadline, and it reads the world as
  /// it stood at the release (StepContext::version), whatever others write meanwhile.
  bool own_thread = false;
};

/// One step. Valid during step() alone.
class StepContext {
 public:
  std::uint64_t run = 0;     ///< index of this run, from 0
  std::int64_t time_ns = 0;  ///< run time of the release
  std::int64_t period_ns = 0;
  /// The release's deadline on the database's clock: for the terms of transactions.
  rtstdb::ClockTime deadline{};
  /// The world's latest version at the release.
  rtstdb::Version version = 0;
  /// By port, in the order of Ports::inputs. Unconnected ones read their `initial` and are not fresh.
  std::span<const signals::SignalValue> inputs;
  /// By port, in the order of Ports::outputs; holds the values of the last run.
  std::span<double> outputs;
  EventLog* events = nullptr;

  rtstdb::WorldTime world_time() const noexcept { return rtstdb::world_time_ns(time_ns); }
  /// Carries out the transaction, and accounts for the time this step waits for it.
  const rtstdb::Outcome& execute(rtstdb::Database& database, rtstdb::Transaction& transaction) noexcept;

  std::int64_t blocked_ns = 0;
  std::int64_t gpu_ns = 0;
  /// What became of the first transaction of this step that came to nothing; idle: there was none.
  rtstdb::Status failure = rtstdb::Status::idle;
};

class Module {
 public:
  virtual ~Module() = default;
  virtual const Ports& ports() const noexcept = 0;
  /// What the parameters (those that create had) ask and this task can not give, each with its place. As create,
  /// it opens nothing; configure then takes it for granted.
  virtual void check_task(const config::Value& parameters, const TaskFacts& task,
                          config::Diagnostics& diagnostics) const {
    (void)parameters, (void)task, (void)diagnostics;
  }
  /// Throws SetupError.
  virtual void configure(World& world, EventLog& events, const TaskFacts& task) = 0;
  virtual void step(StepContext& context) noexcept = 0;
  /// Adds what a history of the run needs to know of this module. After configure.
  virtual void describe(std::vector<contribution::ModuleRecord>& records) const { (void)records; }
  /// Adds to the report of the run: events, shapes and tracks of the map, sections. After the last tick.
  virtual void contribute(contribution::Contribution& report) const { (void)report; }
};

/// A kind of module: what `type:` names in a scenario.
struct ModuleType {
  std::string name;
  std::string about;          ///< one sentence for the documentation
  config::Schema parameters;  ///< a record
  /// Finds what the schema can not say and adds it to the diagnostics; then returns null.
  std::unique_ptr<Module> (*create)(const config::Value& parameters, config::Diagnostics& diagnostics);
};

/// All module types of the program, by name (registry.cpp lists them).
const std::vector<ModuleType>& module_types();
const ModuleType* find_module_type(const std::string& name);

}  // namespace hil::modules
