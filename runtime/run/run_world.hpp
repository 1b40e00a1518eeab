#pragma once
// The world of a run: the database, the scenery, and the modules as tasks. Constructing it opens all of them;
// close() ends the database. A run without bodies whose modules need no world opens no database.
//
// Threads: construction, close and the record on the thread that opens the run; check on one ordinary thread
// while the run goes on.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/modules/named_world.hpp"
#include "runtime/modules/recorded_camera.hpp"
#include "runtime/modules/run_events.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/file_streams.hpp"
#include "runtime/run/module_task.hpp"
#include "runtime/run/run_context.hpp"
#include "runtime/run/wiring.hpp"
#include "runtime/run/world_fields.hpp"

namespace hil::run {

class RunWorld {
 public:
  /// Opens the database, creates the scenery, configures the modules and writes world.json. Throws GpuError,
  /// MemoryError, io::DeviceError or modules::SetupError. `wiring` and `context` outlive it, but the modules
  /// of the wiring end with it.
  RunWorld(Wiring& wiring, RunContext& context);

  /// By the order of the scenario's tasks.
  const std::vector<std::unique_ptr<ModuleTask>>& tasks() const noexcept { return tasks_; }
  /// A step of a module threw. The tick.
  bool has_failed_task() const noexcept {
    return std::ranges::any_of(tasks_, [](const auto& task) { return task->has_failed(); });
  }
  bool has_database() const noexcept { return database_ != nullptr; }
  /// The device is lost, and no other one has taken its place.
  bool device_lost() const { return database_ != nullptr && database_->health().device_lost; }

  /// Reports to run.log when the device was lost and replaced, and when the log refuses transactions.
  /// False: the run has to end, since the world can not be queried or written any more.
  bool check();

  /// Draws the views, closes the database and the files of modules, and fills in record.views,
  /// record.database_log, and the transactions and the scheduler of the run, without those of the views.
  /// Returns sentences on what the history, the views and the files lack. Transactions fail from here on.
  /// `end_ns`: run time at which the run ended.
  std::vector<std::string> close(std::int64_t end_ns, report::RunRecord& record);

  /// Fills in the device, what was not reserved, and what was degraded. `record.tasks` is there.
  void fill(report::RunRecord& record) const;
  /// Fills in the map, the sections and the lists, adds events, and writes images and files: what the scenery
  /// and the modules contribute. Files that can not be written are failures of the record.
  void add_contributions(std::int64_t end_ns, report::RunRecord& record) const;
  /// The events that modules, stimuli and faults noted in the tick.
  modules::RunEvents& events() noexcept { return events_; }
  const modules::RunEvents& events() const noexcept { return events_; }

 private:
  /// Destroys the modules, whose queries must not outlive the database.
  struct ModuleRelease {
    Wiring& wiring;
    ~ModuleRelease();
  };

  void open_database();
  void write_world_record() const;
  void draw_views_into(std::int64_t end_ns, report::RunRecord& record, std::vector<std::string>& faults);
  std::vector<rtstdb::Motion> motions_of_scenery() const;
  void add_unanswered_runs(report::RunRecord& record) const;

  Wiring& wiring_;
  RunContext& context_;
  WorldFields fields_;
  std::unique_ptr<rtstdb::Database> database_;  // refers to the fields; null: the run needs none
  std::unique_ptr<modules::NamedWorld> world_;
  ModuleRelease module_release_;  // before the database, also when the constructor throws
  RunFileStreams file_streams_;
  modules::RunEvents events_;
  std::vector<modules::RecordedCamera> views_;
  std::vector<std::unique_ptr<ModuleTask>> tasks_;
  std::vector<rtstdb::Motion> last_motions_;  ///< of the scenery, when the database was closed
  std::uint64_t reported_losses_ = 0;         ///< of the device
  bool was_lost_ = false;                     ///< at the last check
  bool log_has_refused_ = false;
};

}  // namespace hil::run
