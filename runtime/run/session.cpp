#include "runtime/run/session.hpp"

#include <sys/utsname.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <utility>

#include "runtime/report/quantities.hpp"
#include "runtime/report/report_text.hpp"
#include "runtime/run/descriptors.hpp"
#include "runtime/run/live_session.hpp"
#include "runtime/run/run_record_parts.hpp"
#include "runtime/run/scenery.hpp"

namespace hil::run {
namespace {

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string kernel_words() {
  utsname names{};
  uname(&names);
  return std::string(names.sysname) + " " + names.release + " " + names.version;
}

executive::OverrunPolicy policy_of(config::Overrun overrun) {
  switch (overrun) {
    case config::Overrun::skip:
      return executive::OverrunPolicy::skip;
    case config::Overrun::queue:
      return executive::OverrunPolicy::queue;
    case config::Overrun::abort:
      return executive::OverrunPolicy::abort;
  }
  return executive::OverrunPolicy::skip;
}

std::string log_refusal(const report::DatabaseLog& log) {
  return "the database's log refused " + std::to_string(log.refused_transactions) +
         " transactions that write, under durability " + log.durability + ": " +
         (log.last_fault.empty() ? "the disk was too slow" : log.last_fault);
}

/// What is known of a run before it begins.
void describe(const config::Scenario& scenario, const SessionOptions& options, report::RunRecord& record) {
  record.scenario = {scenario.name, scenario.file, scenario.about};
  record.clock = scenario.clock == config::ClockKind::virtual_time ? "virtual" : "realtime";
  record.duration_ns = scenario.duration_ns;
  record.seed = scenario.seed;
  record.overrides = options.overrides;
  record.program_version = HIL_VERSION;
}

}  // namespace

report::RunRecord record_of_refusal(const config::Scenario& scenario, const SessionOptions& options,
                                    report::Verdict verdict, int exit_code, const std::string& why) {
  report::RunRecord record;
  describe(scenario, options, record);
  record.started_at = utc_now();
  record.period_ns = scenario.base_period_ns;
  record.realtime.kernel = kernel_words();
  record.verdict = verdict;
  record.exit_code = exit_code;
  record.reason = why;
  for (const config::Expectation& expectation : scenario.expectations)
    record.expectations.push_back({.name = expectation.name,
                                   .result = report::ExpectationResult::not_checked,
                                   .detail = "no part of the run was judged"});
  return record;
}

void LiveSession::add_tasks(executive::Executive& executive) {
  for (std::size_t i = 0; i < module_tasks_.size(); ++i) {
    const config::TaskSection& section = *wiring_.modules[i].section;
    executive.add_task({.name = section.module.text,
                        .every_ticks = section.every_ticks,
                        .offset_ticks = section.offset_ticks,
                        .deadline_ns = section.deadline_ns,
                        .budget_ns = section.budget_ns,
                        .overrun = policy_of(section.overrun),
                        .warmup_runs = section.warmup_runs,
                        .thread = section.thread},
                       *module_tasks_[i]);
  }
  std::size_t link = 0;
  const auto add_device = [&](const std::string& name, std::uint32_t every_ticks) {
    executive.add_task({.name = name, .every_ticks = every_ticks, .thread = {}}, *links_[link++]);
  };
  for (const Bus& bus : buses_)
    add_device("can." + bus.wired->section->bus.text, bus.wired->section->every_ticks);
  for (const Unit& unit : units_)
    add_device("modbus." + unit.wired->section->unit.text, unit.wired->section->every_ticks);
}

report::LiveStatus LiveSession::live_status(const executive::Executive& executive) {
  const executive::LiveSnapshot snapshot = executive.live();
  report::LiveStatus status;
  status.run_time_ns = snapshot.run_time_ns;
  status.duration_ns = scenario_.duration_ns;
  status.tick_rate_hz = static_cast<double>(snapshot.ticks_begun - last_live_ticks_);
  last_live_ticks_ = snapshot.ticks_begun;
  for (const executive::LiveTask& task : snapshot.tasks) {
    status.misses += task.deadline_misses;
    if (task.runs > 0)
      status.min_slack_ns = std::min(status.min_slack_ns.value_or(task.slack_min_ns), task.slack_min_ns);
  }
  for (const Bus& bus : buses_)
    status.buses.push_back({bus.wired->section->bus.text, bus.device->counters().bus_load});
  return status;
}

void LiveSession::look_at_gpu() {
  const rtstdb::Health health = database_->health();
  // Another one takes its place in less time than lies between two looks, or does not.
  if (health.device_lost && std::exchange(gpu_was_lost_, true)) stop_.store(true);
  if (health.device_lost) return;
  gpu_was_lost_ = false;
  if (std::exchange(gpu_losses_, health.device_losses) != health.device_losses)
    run_log_.warn(health.device_loss);
}

void LiveSession::look_at_log() {
  const std::uint64_t refused = database_->counts().refused_by_log;
  if (refused == 0 || std::exchange(log_has_refused_, true)) return;
  run_log_.warn("the database's log refuses what modules write: the run ends");
  stop_.store(true);
}

void LiveSession::close_devices() noexcept {
  if (processes_) processes_->end_watch();
  // Safe values go out before anything closes.
  for (const auto& link : links_)
    link->device().enter_safe_state();
  for (const auto& link : links_)
    link->device().stop();
  if (processes_) exits_ = processes_->stop();
  processes_.reset();
}

executive::RunResult LiveSession::run_watched(executive::Executive& executive) {
  const ProcessWatch::Watching watching = processes_->watch(
      [this](const ProcessExit& exit_state) {
        if (exit_state.safe_on_exit) {
          for (const auto& link : links_)
            link->device().enter_safe_state();
          stop_.store(true);
        }
        run_log_.warn("process " + exit_state.name + " " + exit_state.exit +
                      (exit_state.safe_on_exit ? ": outputs go to their safe values, the run ends" : ""));
      },
      [this, &executive] {
        look_at_gpu();
        look_at_log();
        device_watch_->look(device_clock_.told_ns(), [this](bool good, const std::string& sentence) {
          good ? run_log_.info(sentence) : run_log_.warn(sentence);
        });
        if (options_.every_second) options_.every_second(live_status(executive));
      });
  executive::RunResult result = executive.run(stop_);
  if (!io_fault().empty()) processes_->end_watch_after_an_end(std::chrono::milliseconds(100));
  return result;
}

SessionResult LiveSession::run(const std::atomic<bool>& stop_requested) {
  executive::ExecutiveOptions options;
  options.base_period_ns = scenario_.base_period_ns;
  options.duration_ticks = scenario_.duration_ticks;
  options.clock = &clock();
  options.hooks = this;
  options.realtime = {.scheduler = scenario_.realtime.scheduler == config::Scheduler::fifo
                                       ? executive::Scheduler::fifo
                                       : executive::Scheduler::other,
                      .priority = scenario_.realtime.priority,
                      .lock_memory = scenario_.realtime.lock_memory,
                      .cpus = scenario_.realtime.cpus};
  options.watchdog.timeout_ns = scenario_.realtime.watchdog_ns;
  options.watchdog.safe_state = [this] {
    for (const auto& link : links_)
      link->device().enter_safe_state();
    stop_.store(true);
    run_log_.warn("the base thread makes no ticks: outputs go to their safe values");
  };
  executive::Executive executive(options);
  add_tasks(executive);
  SessionResult session;
  report::RunRecord& record = session.record;
  record.started_at = utc_now();
  run_log_.info("the run begins");
  const auto began = std::chrono::steady_clock::now();
  const executive::RunResult result = run_watched(executive);
  record.wall_ns = (std::chrono::steady_clock::now() - began).count();
  run_log_.info("the run is over after " + std::to_string(result.ticks) +
                " ticks; outputs go to their safe values");
  const std::string fault = io_fault();
  close_devices();
  device_watch_->take_last_events([this](const std::string& sentence) { run_log_.warn(sentence); });
  run_log_.info("all devices and processes are closed");
  end_database(record);
  end_logs();
  const bool interrupted = result.stopped && stop_requested.load();
  if (!fault.empty()) record.failures.push_back(fault);
  fill_record(result, record);
  decide({.result = result,
          .gpu_lost = database_->health().device_lost,
          .interrupted = interrupted,
          .max_lost = scenario_.realtime.max_lost,
          .fail_on = options_.fail_on},
         record);
  for (const std::string& failure : record.failures)
    run_log_.warn(failure);
  if (const std::string sentence = report::ticks_given_up(record); !sentence.empty())
    run_log_.warn(report::to_ascii(sentence));
  for (const std::string& sentence : record.realtime.degraded)
    run_log_.warn("degraded: " + sentence);
  session.trace = trace_of(result, record.events);
  return session;
}

void LiveSession::end_database(report::RunRecord& record) {
  const auto ended = database_->close();
  const rtstdb::Durability durability = database_->durability();
  const report::DatabaseLog& log = record.database_log =
      database_log_of(durability, database_->latest().version, database_->counts());
  if (log.refused_transactions > 0) write_faults_.push_back(log_refusal(log));
  if (!ended) write_faults_.push_back("the database's log could not be ended: " + ended.error().message);
  if (durability.mode == rtstdb::DurabilityMode::volatile_only) return;
  if (log.durable_version < log.latest_version) {
    write_faults_.push_back(
        "the world's history is on disk up to version " + std::to_string(log.durable_version) + " of " +
        std::to_string(log.latest_version) + (log.last_fault.empty() ? "" : ": " + log.last_fault));
  } else if (log.commits_in_gaps > 0) {
    write_faults_.push_back("the world's history lacks " + std::to_string(log.commits_in_gaps) +
                            " commits: the disk was too slow");
  }
}

void LiveSession::end_logs() {
  const auto add = [this](const std::string& fault) {
    if (!fault.empty()) write_faults_.push_back(fault);
  };
  add(log_->close());
  if (const std::uint64_t rows = log_->lost_rows(); rows > 0)
    add("signals.csv lacks " + std::to_string(rows) + " rows: the disk was too slow");
  std::vector<std::string> files{"signals.csv", "run.log", "world.json"};
  for (const Bus& bus : buses_) {
    add(bus.device->log_fault());
    const std::uint64_t frames = bus.device->counters().log_dropped;
    const std::string file = "can-" + bus.device->name() + ".log";
    if (frames > 0 && bus.device->log_fault().empty())
      add(file + " lacks " + std::to_string(frames) + " frames: the disk was too slow");
    files.push_back(file);
  }
  for (const ProcessExit& exit_state : exits_) {
    add(exit_state.output_fault);
    files.push_back(exit_state.name + ".out");
  }
  if (scenario_.world.durability != config::Durability::none) files.push_back("database");
  for (const std::string& file : files) {
    std::error_code error;
    if (!std::filesystem::exists(options_.directory / file, error))
      add((options_.directory / file).string() + " was removed while the run went on");
  }
}

std::string LiveSession::io_fault() const {
  for (const auto& link : links_) {
    if (link->in_step()) continue;
    const std::string fault = link->device().health().fault;
    return "device " + link->device().name() + " fell out of step: " + (fault.empty() ? "no answer" : fault);
  }
  return {};
}

/// A run that the world gave no answer kept its time, and its outputs tell of an earlier instant.
void LiveSession::tell_unanswered_runs(report::RunRecord& record) const {
  for (std::size_t i = 0; i < module_tasks_.size(); ++i) {
    report::Task& task = record.tasks[i];
    task.without_answer = module_tasks_[i]->runs_without_answer();
    if (task.without_answer == 0) continue;
    record.realtime.degraded.push_back("task " + task.name + ": " + std::to_string(task.without_answer) +
                                       " of " + std::to_string(task.runs + task.warmup_runs) +
                                       " runs got no answer from the world (the first: " +
                                       rtstdb::to_string(module_tasks_[i]->first_failure()) +
                                       "); their outputs are those of an earlier run");
  }
}

/// The most serious first: ended processes, then (added before this call) devices out of step, then losses,
/// frames not sent, files not written.
void LiveSession::add_failures(std::int64_t end_ns, report::RunRecord& record) const {
  std::vector<std::string> ended;
  for (const ProcessExit& exit_state : exits_) {
    if (!exit_state.ended_early) continue;
    if (exit_state.safe_on_exit) {
      ended.push_back("process " + exit_state.name + " " + exit_state.exit +
                      " before the run was over; outputs were set to their safe values");
    } else {
      record.losses.push_back({.what = "process " + exit_state.name,
                               .begin_ns = exit_state.ended_at_ns,
                               .duration_ns = end_ns - exit_state.ended_at_ns,
                               .to_the_end = true,
                               .permitted = exit_state.may_be_lost,
                               .cause = exit_state.exit});
    }
  }
  record.failures.insert(record.failures.begin(), ended.begin(), ended.end());
  for (report::Loss& loss : loss_watch_->losses(end_ns))
    record.losses.push_back(std::move(loss));
  std::stable_sort(record.losses.begin(), record.losses.end(),
                   [](const auto& left, const auto& right) { return left.begin_ns < right.begin_ns; });
  record.losses_not_listed = loss_watch_->not_listed();
  for (const report::Loss& loss : record.losses) {
    if (!loss.permitted) record.failures.push_back(report::to_ascii(report::sentence_of(loss)));
  }
  for (const auto& link : links_) {
    if (const std::string fault = link->device().send_fault(); !fault.empty())
      record.failures.push_back(fault);
  }
  record.failures.insert(record.failures.end(), write_faults_.begin(), write_faults_.end());
}

/// What the scenario and the modules show: the map, further events, sections.
void LiveSession::add_contributions(std::int64_t end_ns, report::RunRecord& record) const {
  contribution::Contribution all;
  all.end_ns = end_ns;
  all.map.shapes = outlines(scenario_, wiring_.scenery, end_ns);
  for (const WiredModule& wired : wiring_.modules)
    wired.module->contribute(all);
  record.events.insert(record.events.end(), all.events.begin(), all.events.end());
  record.sections = std::move(all.sections);
  record.top_view = report::TopView{.time_ns = end_ns,
                                    .view = {},
                                    .shapes = std::move(all.map.shapes),
                                    .tracks = std::move(all.map.tracks),
                                    .fan = all.map.field_of_view,
                                    .scan_points = std::move(all.map.sensor_points)};
}

void LiveSession::fill_record(const executive::RunResult& result, report::RunRecord& record) {
  describe(scenario_, options_, record);
  take_executive(result, scenario_, record);
  tell_unanswered_runs(record);
  record.realtime.kernel = kernel_words();
  const rtstdb::DeviceInfo& device = database_->device();
  record.gpu = {device.name, device.driver, device.api};
  for (const std::string& sentence : degraded_.all())
    record.realtime.degraded.push_back(sentence);
  for (const std::string& sentence : database_->health().degraded)
    record.realtime.degraded.push_back(sentence);
  record.transactions = transactions_of(database_->counts());
  record.scheduler = scheduler_of(database_->scheduler_counts());
  record.scheduler.not_reserved = world_->not_reserved();
  for (const Bus& bus : buses_)
    record.can.push_back(can_bus_of(*bus.device));
  for (const Unit& unit : units_) {
    record.modbus.push_back(unit.client ? modbus_unit_of(*unit.client) : modbus_unit_of(*unit.server));
  }
  for (const ProcessExit& exit_state : exits_) {
    record.processes.push_back(
        {exit_state.name, exit_state.command, exit_state.exit,
         exit_state.ended_early ? std::optional(exit_state.ended_at_ns) : std::nullopt});
  }
  const Extent extent{.end_ns = result.run_time_ns,
                      .ticks = std::max(scenario_.duration_ticks, record.ticks + record.skipped_ticks),
                      .period_ns = record.period_ns};
  for (const auto& judge : judges_) {
    record.expectations.push_back(judge->result(extent));
    if (auto times = judge->response_times(result.run_time_ns))
      record.response_times.push_back(std::move(*times));
  }
  for (const modules::EventLog::Event& event : events_.events())
    record.events.push_back({event.time_ns, event.text});
  record.events.insert(record.events.end(), device_watch_->events().begin(), device_watch_->events().end());
  for (const ProcessExit& exit_state : exits_) {
    if (exit_state.ended_early)
      record.events.push_back({exit_state.ended_at_ns, "process " + exit_state.name + " " + exit_state.exit});
  }
  std::stable_sort(record.events.begin(), record.events.end(),
                   [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
  add_contributions(result.run_time_ns, record);
  if (events_.lost() > 0) {
    record.realtime.degraded.push_back("the event list lacks " + std::to_string(events_.lost()) +
                                       " events: it was full");
  }
  add_failures(result.run_time_ns, record);
}

SessionResult run_session(Wiring wiring, const SessionOptions& options,
                          const std::atomic<bool>& stop_requested) {
  require_descriptors(*wiring.scenario);
  LiveSession session(std::move(wiring), options);
  session.open(stop_requested);
  return session.run(stop_requested);
}

}  // namespace hil::run
