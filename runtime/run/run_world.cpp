#include "runtime/run/run_world.hpp"

#include <algorithm>
#include <new>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "io/device.hpp"
#include "runtime/config/world_limits.hpp"
#include "runtime/contribution/world_record.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/report_files.hpp"
#include "runtime/run/contributed_files.hpp"
#include "runtime/run/database_record.hpp"
#include "runtime/run/report_image.hpp"
#include "runtime/run/run_folder.hpp"
#include "runtime/run/scenery.hpp"
#include "runtime/run/step_guard.hpp"
#include "runtime/run/world_views.hpp"

namespace hil::run {
namespace {

/// Files of the log are allocated ahead: this is the least that a short run leaves.
constexpr std::uint64_t log_segment_bytes = std::uint64_t{2} << 20;

rtstdb::DurabilityMode durability_mode(config::Durability durability) {
  switch (durability) {
    case config::Durability::none:
      return rtstdb::DurabilityMode::volatile_only;
    case config::Durability::async:
      return rtstdb::DurabilityMode::async;
    case config::Durability::group:
      return rtstdb::DurabilityMode::group;
    case config::Durability::sync:
      return rtstdb::DurabilityMode::sync;
  }
  return rtstdb::DurabilityMode::volatile_only;
}

rtstdb::DurabilityOptions durability_of(const RunContext& context) {
  static_assert(config::min_log_ring_bytes == rtstdb::min_ring_bytes &&
                config::max_log_ring_bytes == rtstdb::max_ring_bytes);
  const config::World& world = context.scenario.world;
  rtstdb::DurabilityOptions options;
  if (world.durability == config::Durability::none) return options;
  options.directory = database_folder(context.options.directory);
  options.mode = durability_mode(world.durability);
  options.flush_interval = rtstdb::Nanoseconds(world.flush_interval_ns);
  options.ring_bytes = world.log_ring_bytes;
  options.segment_bytes = log_segment_bytes;
  return options;
}

bool needs_database(const Wiring& wiring) {
  return !wiring.scenario->world.entities.empty() ||
         std::ranges::any_of(wiring.modules, [](const WiredModule& wired) {
           return wired.module->world_module() != nullptr;
         });
}

/// Throws SetupError, or an exception that says why memory, a thread or a file is missing.
void configure(modules::AnyModule& module, modules::World& world, const modules::Setup& setup,
               const std::string& name) {
  try {
    if (modules::WorldModule* const in_world = module.world_module()) in_world->configure(world, setup);
    if (modules::Module* const plain = module.plain_module()) plain->configure(setup);
  } catch (const modules::SetupError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::system_error&) {
    throw;
  } catch (...) {
    throw modules::SetupError(name + " can not be configured: " + text_of_exception());
  }
}

std::string log_refusal(const report::DatabaseLog& log) {
  return "the database's log refused " + std::to_string(log.refused_transactions) +
         " transactions that write, under durability " + log.durability + ": " +
         (log.last_fault.empty() ? "the disk was too slow" : log.last_fault);
}

}  // namespace

RunWorld::ModuleRelease::~ModuleRelease() {
  for (WiredModule& wired : wiring.modules)
    wired.module.reset();
}

RunWorld::RunWorld(Wiring& wiring, RunContext& context)
    : wiring_(wiring),
      context_(context),
      fields_(context.log),
      module_release_{wiring},
      file_streams_(context.options.directory, context.is_virtual) {
  if (needs_database(wiring_)) {
    open_database();
    context_.log.info("GPU: " + database_->device().name + ", " + database_->device().driver);
  }
  world_ = std::make_unique<modules::NamedWorld>(database_.get(), wiring_.layers.names());
  if (database_ != nullptr) create_scenery(context_.scenario, wiring_.scenery, *world_, fields_);
  for (WiredModule& wired : wiring_.modules) {
    const modules::TaskParameters facts = task_parameters(context_.scenario, *wired.section);
    const modules::Setup setup{.task = facts, .events = events_, .files = file_streams_};
    const std::string name = name_with_plugin(wired.section->module.text, wired.section->type.text);
    configure(*wired.module, *world_, setup, name);
    tasks_.push_back(std::make_unique<ModuleTask>(name, *wired.module, wired.links, facts.deadline_ns,
                                                  wiring_.signals, database_.get(), context_.device_clock,
                                                  events_, facts.firm));
  }
  if (database_ == nullptr) return;
  fields_.log_built(*database_);
  views_ = cameras_of_views(context_.scenario.world, *world_);
  write_world_record();
}

void RunWorld::open_database() {
  const config::World& world = context_.scenario.world;
  rtstdb::DatabaseOptions options;
  options.gpu = world.gpu;
  options.max_entities = world.max_entities;
  options.max_geometries = world.max_geometries;
  options.retained_changes = world.retained_changes;
  options.queue_capacity = world.queue_capacity;
  options.chunk = rtstdb::Nanoseconds(world.chunk_ns);
  options.clock = &context_.database_clock;
  options.durability = durability_of(context_);
  if (!context_.is_virtual && context_.scenario.realtime.scheduler == config::Scheduler::fifo)
    options.thread_priority = context_.scenario.realtime.priority;
  auto opened = rtstdb::Database::open(options);
  if (!opened && opened.error().code == rtstdb::ErrorCode::file)
    throw io::DeviceError(opened.error().message);
  if (!opened && opened.error().code == rtstdb::ErrorCode::out_of_memory)
    throw MemoryError(opened.error().message);
  if (!opened) throw GpuError(opened.error().message);
  database_ = std::move(opened).value();
}

void RunWorld::write_world_record() const {
  contribution::WorldRecord record;
  record.scenario = context_.scenario.name;
  record.plugins = context_.scenario.plugins;
  if (const std::uint64_t id = database_->durability().database_id; id != 0)
    record.database_id = report::id_text(id);
  record.period_ns = context_.scenario.base_period_ns;
  world_->describe(record);
  record.fields = fields_.records();
  for (const WiredModule& wired : wiring_.modules) {
    if (const modules::WorldModule* module = wired.module->world_module()) module->describe(record.modules);
  }
  for (const modules::RecordedCamera& view : views_)
    record.modules.push_back(modules::to_module_record(view));
  try {
    report::write_world(record, context_.options.directory);
  } catch (const report::ReportError& error) {
    throw io::DeviceError(error.what());
  }
}

bool RunWorld::check() {
  if (database_ == nullptr) return true;
  bool can_go_on = true;
  const rtstdb::Health health = database_->health();
  if (health.device_lost) {
    // The database replaces a lost device within one check; one that is lost at two checks stays lost.
    can_go_on = !std::exchange(was_lost_, true);
  } else {
    was_lost_ = false;
    if (std::exchange(reported_losses_, health.device_losses) != health.device_losses)
      context_.log.warn(health.device_loss);
  }
  if (database_->counts().refused_by_log > 0 && !std::exchange(log_has_refused_, true)) {
    context_.log.warn("the database's log refuses what modules write: the run ends");
    can_go_on = false;
  }
  return can_go_on;
}

/// An interrupt ends the drawing. One that has ended the run before does not leave the views out.
void RunWorld::draw_views_into(std::int64_t end_ns, report::RunRecord& record,
                               std::vector<std::string>& faults) {
  if (views_.empty()) return;
  context_.log.info("draws " + report::counted(views_.size(), "view", "views"));
  const std::atomic<bool>* const stop = context_.stop_requested.load() ? nullptr : &context_.stop_requested;
  for (std::string& fault : draw_views(views_, *database_, end_ns, context_.options.directory, stop, record))
    faults.push_back(std::move(fault));
}

std::vector<std::string> RunWorld::close(std::int64_t end_ns, report::RunRecord& record) {
  std::vector<std::string> faults;
  if (database_ != nullptr) {
    last_motions_ = motions_of_scenery();
    record.transactions = transactions_of(database_->counts());
    record.scheduler = scheduler_of(database_->scheduler_counts());
    if (!device_lost()) draw_views_into(end_ns, record, faults);
  }
  RunFileStreams::Shortfalls files = file_streams_.close();
  faults.insert(faults.end(), files.failures.begin(), files.failures.end());
  for (const std::string& sentence : files.limits)
    context_.degraded.add(sentence);
  if (database_ == nullptr) return faults;
  const auto ended = database_->close();
  const rtstdb::Durability durability = database_->durability();
  const report::DatabaseLog& log = record.database_log =
      database_log_of(durability, database_->latest().version, database_->counts());
  if (log.refused_transactions > 0) faults.push_back(log_refusal(log));
  if (!ended) faults.push_back("the database's log could not be ended: " + ended.error().message);
  if (durability.mode == rtstdb::DurabilityMode::volatile_only) return faults;
  if (log.durable_version < log.latest_version) {
    faults.push_back("the world's history is on disk up to version " + std::to_string(log.durable_version) +
                     " of " + std::to_string(log.latest_version) +
                     (log.last_fault.empty() ? "" : ": " + log.last_fault));
  } else if (log.commits_in_gaps > 0) {
    faults.push_back("the world's history lacks " + std::to_string(log.commits_in_gaps) +
                     " commits: the disk was too slow");
  }
  return faults;
}

/// A run of a task whose query failed kept its time, but its outputs are those of an earlier instant.
void RunWorld::add_unanswered_runs(report::RunRecord& record) const {
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    report::Task& task = record.tasks[i];
    task.without_result = tasks_[i]->runs_without_result();
    task.discarded = tasks_[i]->discarded_runs();
    const auto recorded = [](const ModuleTask::HardMiss& miss) {
      return report::Miss{miss.tick, miss.cause, miss.lateness_ns};
    };
    task.hard_misses = tasks_[i]->hard_misses();
    for (const ModuleTask::HardMiss& miss : tasks_[i]->first_hard_misses())
      task.first_hard_misses.push_back(recorded(miss));
    task.worst_hard_miss = recorded(tasks_[i]->worst_hard_miss());
    if (task.without_result == 0) continue;
    record.realtime.degraded.push_back(
        "task " + task.name + ": " + std::to_string(task.without_result) + " of " +
        std::to_string(task.runs + task.warmup_runs) + " runs had no result of the database (the first: " +
        rtstdb::to_string(tasks_[i]->first_failure()) + ")" +
        (task.discarded == 0 ? ""
                             : ", " + std::to_string(task.discarded) +
                                   " of them because a firm transaction was late or not admitted") +
        "; their outputs are those of an earlier run");
  }
}

void RunWorld::fill(report::RunRecord& record) const {
  add_unanswered_runs(record);
  for (const std::string& sentence : context_.degraded.all())
    record.realtime.degraded.push_back(sentence);
  if (database_ == nullptr) return;
  const rtstdb::DeviceInfo& device = database_->device();
  record.gpu = {device.name, device.driver, device.api};
  for (const std::string& sentence : database_->health().degraded)
    record.realtime.degraded.push_back(sentence);
  record.scheduler.not_reserved = world_->not_reserved();
}

/// Modules may have moved bodies of the scenery.
std::vector<rtstdb::Motion> RunWorld::motions_of_scenery() const {
  std::vector<rtstdb::Motion> motions = first_motions(context_.scenario.world);
  const auto states = database_->snapshot({});
  if (!states) return motions;
  std::unordered_map<std::string, rtstdb::Motion> by_name;
  for (const rtstdb::EntityState& state : states.value())
    by_name.emplace(world_->name_of(state.id), state.row.motion);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const auto known = by_name.find(context_.scenario.world.entities[i].name.text);
    if (known != by_name.end()) motions[i] = known->second;
  }
  return motions;
}

void RunWorld::add_contributions(std::int64_t end_ns, report::RunRecord& record) const {
  contribution::Contribution all;
  all.end_ns = end_ns;
  all.map.shapes = outlines(context_.scenario, wiring_.scenery, last_motions_, end_ns);
  for (const WiredModule& wired : wiring_.modules) {
    contribution::Contribution whole = all;
    try {
      wired.module->contribute(whole);
      all = std::move(whole);
    } catch (...) {
      record.failures.push_back("the report lacks what " +
                                name_with_plugin(wired.section->module.text, wired.section->type.text) +
                                " contributes: " + text_of_exception());
    }
  }
  record.events.insert(record.events.end(), all.events.begin(), all.events.end());
  record.sections = std::move(all.sections);
  for (contribution::Section& section : record.sections) {
    for (contribution::ShownImage& image : section.images) {
      image.png = report_png(image.width, image.height, image.rgb);
      image.rgb.clear();
    }
  }
  record.lists = std::move(all.lists);
  for (const std::string& fault : write_files(all, context_.options.directory))
    record.failures.push_back(fault);
  record.top_view = report::TopView{.time_ns = end_ns,
                                    .view = {},
                                    .shapes = std::move(all.map.shapes),
                                    .tracks = std::move(all.map.tracks),
                                    .fan = all.map.field_of_view,
                                    .scan_points = std::move(all.map.sensor_points)};
}

}  // namespace hil::run
