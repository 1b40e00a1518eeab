#pragma once
// The contract of a module that reads or changes the world of a run. It is that of hil/module.hpp, and:
// - configure, on an ordinary thread, also creates the module's entities and prepares its queries.
// - describe, after configure, records what a history of the run needs; ModuleType::make_recorded_scanner
//   reads it, for `hil history`.
// - step also executes transactions, whose terms take the deadline and the version of the step.
//
// World time (rtstdb::WorldTime) has the same numbers as run time.

#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/module.hpp>
#include <hil/world/world.hpp>
#include <rtstdb/database.hpp>

namespace hil::modules {

/// Layers in which a module finds bodies other than those named, so that one of them has to have such a body.
struct BodySearch {
  std::vector<config::Word> layers;
  std::vector<config::Word> without{};
  bool is_whole_purpose = true;  ///< false: a scan or an image without a body is a result too
};

struct WorldPorts : Ports {
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

/// One step of a module that has the world.
struct WorldStep : StepContext {
  /// The release's deadline on the database's clock: for the terms of transactions.
  rtstdb::ClockTime deadline{};
  /// For the terms of transactions that only read. soft: a late result is used; firm: it is discarded.
  rtstdb::DeadlineClass read_class = rtstdb::DeadlineClass::soft;
  /// The world's latest version at the release.
  rtstdb::Version version = 0;

  rtstdb::WorldTime world_time() const noexcept { return rtstdb::world_time_ns(time_ns); }
  /// Executes the transaction, whose deadline is that of the release, and adds the time that the step waits
  /// for it to blocked_ns. Of a transaction that failed only a missed deadline has such a time.
  const rtstdb::Outcome& execute(rtstdb::Database& database, rtstdb::Transaction& transaction) noexcept;

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

class WorldModule : public AnyModule {
 public:
  const WorldPorts& ports() const noexcept override = 0;
  /// Throws SetupError. `world` outlives the module; after the call, the module only reads it.
  virtual void configure(World& world, const Setup& setup) = 0;
  /// Adds what a history of the run needs to know of this module.
  virtual void describe(std::vector<contribution::ModuleRecord>& records) const {
    static_cast<void>(records);
  }
  virtual void step(WorldStep& context) = 0;
  WorldModule* world_module() noexcept final { return this; }
};

}  // namespace hil::modules
