#include "runtime/run/session.hpp"

#include <sys/utsname.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <memory>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include <hil/quantity.hpp>

#include "runtime/executive/executive.hpp"
#include "runtime/expectations/judges.hpp"
#include "runtime/plots/plot_collector.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/report_text.hpp"
#include "runtime/run/descriptors.hpp"
#include "runtime/run/executive_record.hpp"
#include "runtime/run/fault_kinds.hpp"
#include "runtime/run/fault_switches.hpp"
#include "runtime/run/process_watch.hpp"
#include "runtime/run/run_buses.hpp"
#include "runtime/run/run_context.hpp"
#include "runtime/run/run_recording.hpp"
#include "runtime/run/run_world.hpp"
#include "runtime/run/signal_log.hpp"

namespace hil::run {
namespace {

constexpr double signal_log_rate_hz = 100.0;

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string kernel_text() {
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

/// Fills in what is known before the run begins.
void describe(const config::Scenario& scenario, const SessionOptions& options, report::RunRecord& record) {
  record.scenario = {scenario.name, scenario.file, scenario.about};
  record.clock = scenario.clock == config::ClockKind::virtual_time ? "virtual" : "realtime";
  record.duration_ns = scenario.duration_ns;
  record.seed = scenario.seed;
  record.overrides = options.overrides;
  record.program_version = HIL_VERSION;
  record.plugins = scenario.plugins;
  record.buses = buses::empty_groups();
}

/// One run while it lives: wires its world, devices, processes, judges and logs to the executive.
class LiveSession final : public executive::TickHooks {
 public:
  LiveSession(Wiring wiring, const SessionOptions& options, const std::atomic<bool>& stop_requested)
      : wiring_(std::move(wiring)),
        scenario_(*wiring_.scenario),
        context_(scenario_, options, stop_requested),
        log_every_ticks_(std::max<std::uint64_t>(
            1, static_cast<std::uint64_t>(scenario_.base_rate_hz / signal_log_rate_hz))),
        buses_(wiring_, context_, arrivals_) {}
  ~LiveSession() override { close_devices(); }

  void open();
  SessionResult run();

  void before_first_tick(std::int64_t start_ns) noexcept override {
    context_.device_clock.set_origin(start_ns);
    arrivals_.begin();
  }
  void begin_tick(const executive::TickInfo& tick) noexcept override {
    buses_.begin_tick(tick.time_ns);
    wiring_.stimuli.begin_tick(tick.time_ns);
    wiring_.faults.begin_tick(tick.time_ns);
  }
  void end_tick(const executive::TickInfo& tick) noexcept override {
    buses_.end_tick(tick.time_ns);
    wiring_.faults.end_tick(tick.time_ns);
    judges_->check_frames(tick.time_ns);
    wiring_.variables.update(wiring_.signals, tick.time_ns);
    judges_->check(wiring_.signals, tick.time_ns);
    plots_->take(wiring_.signals, tick.time_ns);
    if (recorder_) recorder_->take(wiring_.signals, tick.time_ns);
    if (tick.tick % log_every_ticks_ == 0) signal_log_->take(wiring_.signals, tick.time_ns);
    if (!buses_.in_step() || world_->has_failed_task() ||
        context_.stop_requested.load(std::memory_order_relaxed))
      stop_.store(true, std::memory_order_relaxed);
  }

 private:
  void start_processes();
  void wait_for_programs();
  void start_remaining_devices();
  [[noreturn]] void refuse_ended_process(const std::string& name, const std::string& consequence) const;
  executive::ExecutiveOptions executive_options();
  void add_tasks(executive::Executive& executive);
  executive::RunResult run_watched(executive::Executive& executive);
  void end_on_process_exit(const ProcessExit& exit);
  report::LiveStatus live_status(const executive::Executive& executive);
  void close_devices() noexcept;
  void close_logs();
  void fill_record(const executive::RunResult& result, report::RunRecord& record);
  void name_faults_of_skips(const executive::RunResult& result, report::RunRecord& record) const;
  void note_ended_processes(report::RunRecord& record) const;
  void add_events(report::RunRecord& record) const;
  void add_failures(std::int64_t end_ns, report::RunRecord& record) const;

  // Members are destroyed in the reverse order: what is opened first lives longest.
  Wiring wiring_;
  const config::Scenario& scenario_;
  RunContext context_;
  std::atomic<bool> stop_{false};  ///< the executive stops at the next tick
  const std::uint64_t log_every_ticks_;
  std::unique_ptr<RunWorld> world_;
  std::unique_ptr<recording::Recorder> recorder_;  ///< null: the run is not recorded
  expectations::Arrivals arrivals_;
  RunBuses buses_;
  std::unique_ptr<ProcessWatch> processes_;
  std::vector<ProcessExit> exits_;
  std::optional<FaultSwitches> fault_switches_;
  std::optional<expectations::Judges> judges_;
  std::optional<plots::PlotCollector> plots_;
  std::unique_ptr<SignalLog> signal_log_;
  std::vector<std::string> write_faults_;  ///< why files of the run lack something, one sentence each
  std::uint64_t last_live_ticks_ = 0;
};

void LiveSession::open() {
  context_.log.info("scenario " + scenario_.name + " from " + scenario_.file);
  world_ = std::make_unique<RunWorld>(wiring_, context_);
  wiring_.stimuli.open(wiring_.signals, world_->events());
  recorder_ = make_recorder(wiring_, context_);
  buses_.make_devices(recorder_.get());
  start_processes();
  wait_for_programs();
  start_remaining_devices();
  fault_switches_.emplace(wiring_, buses_, *processes_, world_->tasks());
  wiring_.faults.open(wiring_.signals, world_->events(), fault_switches_->by_fault());
  judges_.emplace(scenario_, wiring_.signals, arrivals_, wiring_.variables);
  plots_.emplace(scenario_, wiring_.signals);
  signal_log_ = std::make_unique<SignalLog>(context_.options.directory / "signals.csv", wiring_.signals,
                                            context_.is_virtual);
}

void LiveSession::start_processes() {
  std::vector<ProcessWatch::Program> programs;
  for (const config::ProcessSection& section : scenario_.processes) {
    if (!section.enabled) continue;
    ProcessWatch::Program program{
        .child = {.name = section.name.text,
                  .command = {},
                  .search_folders = context_.options.program_folders,
                  .working_folder = std::filesystem::path(scenario_.file).parent_path(),
                  .output_file = context_.options.directory / (section.name.text + ".out")},
        .safe_on_exit = section.safe_on_exit && !section.may_be_lost,
        .may_be_lost = section.may_be_lost};
    for (const config::CommandWord& word : section.command) {
      program.child.command.push_back(
          word.expand([this](const std::string& placeholder_section, const std::string& name) {
            return buses_.address_of(placeholder_section, name);
          }));
    }
    programs.push_back(std::move(program));
  }
  processes_ = std::make_unique<ProcessWatch>(programs, [this] { return context_.device_clock.report_ns(); });
  for (const std::string& started : processes_->started())
    context_.log.info("started " + started);
}

/// `consequence`: what followed from its end; empty: nothing yet.
void LiveSession::refuse_ended_process(const std::string& name, const std::string& consequence) const {
  const std::vector<ProcessExit> exits = processes_->stop();
  const ProcessExit& exit = *std::ranges::find(exits, name, &ProcessExit::name);
  std::string sentence = "process " + name + " " + exit.exit + " before the run began; its output is in " +
                         context_.options.directory.string();
  if (!consequence.empty()) sentence += ". After that: " + consequence;
  if (!exit.last_lines.empty()) sentence += ". Its last lines:";
  for (const std::string& line : exit.last_lines)
    sentence += "\n  | " + line;
  throw io::DeviceError(sentence);
}

void LiveSession::wait_for_programs() {
  const auto began = std::chrono::steady_clock::now();
  for (;;) {
    if (buses_.all_programs_connected(*processes_, (std::chrono::steady_clock::now() - began).count()))
      return;
    if (const std::string ended = processes_->first_ended(); !ended.empty()) refuse_ended_process(ended, {});
    if (context_.stop_requested.load())
      throw StoppedError("the run was stopped while its programs were connecting");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

/// Starts the devices that connect to programs, which may have been started by this run.
void LiveSession::start_remaining_devices() {
  try {
    buses_.start_remaining_devices();
  } catch (const io::DeviceError& error) {
    if (context_.stop_requested.load()) throw StoppedError(error.what());
    const std::string ended = processes_->first_ended();
    if (ended.empty()) throw;
    refuse_ended_process(ended, error.what());
  }
}

executive::ExecutiveOptions LiveSession::executive_options() {
  executive::ExecutiveOptions options;
  options.base_period_ns = scenario_.base_period_ns;
  options.duration_ticks = scenario_.duration_ticks;
  options.clock = &context_.clock();
  options.hooks = this;
  if (!scenario_.writes_trace) options.accounting.trace_ns = 0;
  options.realtime = {.scheduler = scenario_.realtime.scheduler == config::Scheduler::fifo
                                       ? executive::Scheduler::fifo
                                       : executive::Scheduler::other,
                      .priority = scenario_.realtime.priority,
                      .lock_memory = scenario_.realtime.lock_memory,
                      .cpus = scenario_.realtime.cpus};
  options.watchdog.timeout_ns = scenario_.realtime.watchdog_ns;
  options.watchdog.safe_state = [this] {
    buses_.enter_safe_state();
    stop_.store(true);
    context_.log.warn("the base thread makes no ticks: outputs go to their safe values");
  };
  return options;
}

void LiveSession::add_tasks(executive::Executive& executive) {
  for (std::size_t i = 0; i < world_->tasks().size(); ++i) {
    const config::TaskSection& section = *wiring_.modules[i].section;
    executive.add_task({.name = section.module.text,
                        .every_ticks = section.every_ticks,
                        .offset_ticks = section.offset_ticks,
                        .deadline_ns = section.deadline_ns,
                        .budget_ns = section.budget_ns,
                        .overrun = policy_of(section.overrun),
                        .warmup_runs = section.warmup_runs,
                        .thread = section.thread},
                       *world_->tasks()[i]);
  }
  buses_.add_tasks(executive);
}

/// "the run begins: crossing, for 10 s in virtual time; its folder is out/crossing"
std::string begin_sentence(const config::Scenario& scenario, const std::filesystem::path& directory) {
  const std::string length = scenario.duration_ns > 0 ? "for " + config::format_duration(scenario.duration_ns)
                                                      : "until it is stopped";
  return "the run begins: " + scenario.name + ", " + length + " in " +
         (scenario.clock == config::ClockKind::virtual_time ? "virtual" : "real") + " time; its folder is " +
         directory.string();
}

SessionResult LiveSession::run() {
  executive::Executive executive(executive_options());
  add_tasks(executive);
  SessionResult session;
  report::RunRecord& record = session.record;
  record.started_at = utc_now();
  const std::string begins = begin_sentence(scenario_, context_.options.directory);
  context_.options.announces_begin ? context_.log.progress(begins) : context_.log.info(begins);
  const auto began = std::chrono::steady_clock::now();
  const executive::RunResult result = run_watched(executive);
  record.wall_ns = (std::chrono::steady_clock::now() - began).count();
  context_.log.info("the run is over after " + std::to_string(result.ticks) +
                    " ticks; outputs go to their safe values");
  const std::string step_fault = buses_.step_fault();
  close_devices();
  judges_->check_last_frames(result.run_time_ns);
  buses_.collect_last_events();
  context_.log.info("all devices and processes are closed");
  write_faults_ = world_->close(result.run_time_ns, record);
  close_logs();
  const bool interrupted = result.stopped && context_.stop_requested.load();
  if (!step_fault.empty()) record.failures.push_back(step_fault);
  for (const auto& task : world_->tasks())
    if (task->has_failed()) record.failures.push_back(task->fault());
  fill_record(result, record);
  decide({.result = result,
          .gpu_lost = world_->device_lost(),
          .interrupted = interrupted,
          .max_lost = scenario_.realtime.max_lost,
          .max_hard_misses = scenario_.realtime.max_hard_misses,
          .fail_on = context_.options.fail_on},
         record);
  for (const report::Event& event : record.events)
    context_.log.info("event at " + config::format_duration(event.time_ns) + ": " + event.text);
  if (const std::string sentence = report::unlisted_events_sentence(record); !sentence.empty())
    context_.log.info(report::to_ascii(sentence));
  for (const std::string& failure : record.failures)
    context_.log.warn(failure);
  for (const std::string& failure : record.input_failures)
    context_.log.warn(failure);
  for (const std::string& sentence : report::sentences_of_unchecked_injections(record))
    context_.log.warn("not checked: " + report::to_ascii(sentence));
  if (const std::string sentence = report::skipped_ticks_sentence(record); !sentence.empty())
    context_.log.warn(report::to_ascii(sentence));
  for (const report::Task& task : record.tasks)
    if (const std::string sentence = report::hard_misses_sentence(task); !sentence.empty())
      context_.log.warn(report::to_ascii(sentence));
  for (const std::string& sentence : record.realtime.degraded)
    context_.log.warn("degraded: " + sentence);
  if (scenario_.writes_trace) session.trace = trace_of(result, record.events);
  return session;
}

/// Runs the executive while an ordinary thread watches processes, devices and the database, and prints the
/// live line.
executive::RunResult LiveSession::run_watched(executive::Executive& executive) {
  const ProcessWatch::Watching watching =
      processes_->watch([this](const ProcessExit& exit) { end_on_process_exit(exit); },
                        [this, &executive] {
                          if (!world_->check()) stop_.store(true);
                          buses_.check();
                          if (context_.options.every_second)
                            context_.options.every_second(live_status(executive));
                        });
  executive::RunResult result = executive.run(stop_);
  if (!buses_.in_step()) processes_->end_watch_after_exit(std::chrono::milliseconds(100));
  return result;
}

void LiveSession::end_on_process_exit(const ProcessExit& exit) {
  if (exit.safe_on_exit) {
    buses_.enter_safe_state();
    stop_.store(true);
  }
  if (exit.may_be_lost) {
    for (const config::ProcessSection& process : scenario_.processes) {
      if (process.name.text != exit.name) continue;
      for (const std::size_t bus : buses_in(process, wiring_))
        buses_.note_permitted_exit(bus);
    }
  }
  context_.log.warn("process " + exit.name + " " + exit.exit +
                    (exit.safe_on_exit ? ": outputs go to their safe values, the run ends" : ""));
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
  status.buses = buses_.bus_loads();
  return status;
}

/// Safe values are sent before anything closes; processes end after the devices that talk to them.
void LiveSession::close_devices() noexcept {
  if (processes_) processes_->end_watch();
  buses_.stop();
  if (processes_) exits_ = processes_->stop();
  processes_.reset();
}

/// Closes signals.csv and collects why files of the run lack something. After close_devices.
void LiveSession::close_logs() {
  const auto add = [this](const std::string& fault) {
    if (!fault.empty()) write_faults_.push_back(fault);
  };
  add(context_.log.fault());
  add(signal_log_->close());
  if (const std::uint64_t rows = signal_log_->lost_rows(); rows > 0)
    add("signals.csv lacks " + std::to_string(rows) + " rows: the disk was too slow");
  for (const std::string& fault : buses_.log_faults())
    add(fault);
  std::vector<std::string> files{"signals.csv", "run.log"};
  for (const std::string& file : buses_.log_files())
    files.push_back(file);
  for (const ProcessExit& exit : exits_) {
    add(exit.output_fault);
    files.push_back(exit.name + ".out");
  }
  if (world_->has_database()) {
    files.push_back("world.json");
    if (scenario_.world.durability != config::Durability::none) files.push_back("database");
  }
  for (const std::string& file : files) {
    const std::filesystem::path path = context_.options.directory / file;
    std::error_code error;
    if (!std::filesystem::exists(path, error)) add(path.string() + " was removed while the run went on");
  }
}

void LiveSession::fill_record(const executive::RunResult& result, report::RunRecord& record) {
  describe(scenario_, context_.options, record);
  take_executive(result, scenario_, record);
  record.realtime.kernel = kernel_text();
  world_->fill(record);
  buses_.fill(result.run_time_ns, record);
  for (const ProcessExit& exit : exits_) {
    record.processes.push_back({exit.name, exit.command, exit.exit,
                                exit.ended_early ? std::optional(exit.ended_at_ns) : std::nullopt,
                                exit.last_lines});
  }
  judges_->fill({.end_ns = result.run_time_ns,
                 .ticks = std::max(scenario_.duration_ticks, record.ticks + record.skipped_ticks),
                 .period_ns = record.period_ns},
                record);
  wiring_.stimuli.fill(result.run_time_ns, record);
  wiring_.faults.fill(result.run_time_ns, record);
  name_faults_of_skips(result, record);
  note_ended_processes(record);
  plots_->fill(wiring_.signals, result.run_time_ns, record);
  add_events(record);
  world_->add_contributions(result.run_time_ns, record);
  if (recorder_) {
    for (std::string& fault : close_recording(*recorder_, context_.options.directory, record))
      write_faults_.push_back(std::move(fault));
  }
  add_failures(result.run_time_ns, record);
  record.input_failures = buses_.input_failures();
}

/// Ticks that a fault of the scenario makes the run skip are what its author asked for.
void LiveSession::name_faults_of_skips(const executive::RunResult& result, report::RunRecord& record) const {
  for (report::MissingTicks& ticks : std::span(record.watchdog).subspan(result.hang ? 1 : 0)) {
    for (std::size_t i = 0; i < scenario_.faults.size(); ++i) {
      const config::FaultSection& section = scenario_.faults[i];
      if (section.target != config::FaultTarget::task) continue;
      const auto& effect = dynamic_cast<const TaskFault&>(*section.effect);
      const bool was_active =
          std::ranges::any_of(record.faults[i].spans, [&](const report::ActiveSpan& span) {
            return span.begin_ns <= ticks.time_ns && ticks.time_ns <= span.end_ns + effect.aftermath_ns();
          });
      if (!was_active) continue;
      ticks.fault = section.name.text;
      ticks.text +=
          "; fault " + section.name.text + ": task " + section.subject.text + " " + effect.sentence();
    }
  }
}

/// A fault of a process that had ended by itself took no effect.
void LiveSession::note_ended_processes(report::RunRecord& record) const {
  for (std::size_t i = 0; i < scenario_.faults.size(); ++i) {
    report::Injection& fault = record.faults[i];
    const bool is_of_process = scenario_.faults[i].target == config::FaultTarget::process;
    const auto exit = std::ranges::find(exits_, fault.target, &ProcessExit::name);
    if (!is_of_process || !fault.first_begin_ns || exit == exits_.end()) continue;
    if (!exit->ended_early || !exit->fault.empty() || exit->ended_at_ns > *fault.first_begin_ns) continue;
    fault.took_effect = false;
    fault.missing_effect =
        "the process had ended at " + report::to_ascii(report::chosen_time(exit->ended_at_ns));
  }
}

/// Events of modules, devices and processes, by time.
void LiveSession::add_events(report::RunRecord& record) const {
  for (const modules::RunEvents::Event& event : world_->events().events())
    record.events.push_back({event.time_ns, event.text});
  record.events.insert(record.events.end(), buses_.events().begin(), buses_.events().end());
  for (const ProcessExit& exit : exits_) {
    if (exit.ended_early)
      record.events.push_back({exit.ended_at_ns, "process " + exit.name + " " + exit.exit});
  }
  std::stable_sort(record.events.begin(), record.events.end(),
                   [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
  record.events_not_listed = world_->events().lost();
}

/// Adds the losses and the failures, the most serious first: ended processes, then (added before this call)
/// devices out of step, then losses, frames not sent, files not written.
void LiveSession::add_failures(std::int64_t end_ns, report::RunRecord& record) const {
  std::vector<std::string> ended;
  for (const ProcessExit& exit : exits_) {
    if (!exit.ended_early || !exit.safe_on_exit) continue;
    ended.push_back("process " + exit.name + " " + exit.exit +
                    " before the run was over; outputs were set to their safe values");
  }
  record.failures.insert(record.failures.begin(), ended.begin(), ended.end());
  record.losses = buses_.losses().losses(end_ns, exits_);
  record.losses_not_listed = buses_.losses().not_listed();
  for (const report::Loss& loss : record.losses) {
    if (!loss.permitted) record.failures.push_back(report::to_ascii(report::sentence_of(loss)));
  }
  for (std::string& fault : buses_.send_faults())
    record.failures.push_back(std::move(fault));
  record.failures.insert(record.failures.end(), write_faults_.begin(), write_faults_.end());
}

}  // namespace

report::RunRecord record_of_refusal(const config::Scenario& scenario, const SessionOptions& options,
                                    report::Verdict verdict, int exit_code, const std::string& reason) {
  report::RunRecord record;
  describe(scenario, options, record);
  record.started_at = utc_now();
  record.period_ns = scenario.base_period_ns;
  record.realtime.kernel = kernel_text();
  record.verdict = verdict;
  record.exit_code = exit_code;
  record.reason = reason;
  for (const config::Expectation& expectation : scenario.expectations)
    record.expectations.push_back({.name = expectation.name,
                                   .result = report::ExpectationResult::not_checked,
                                   .detail = "no tick of the run was evaluated"});
  return record;
}

SessionResult run_session(Wiring wiring, const SessionOptions& options,
                          const std::atomic<bool>& stop_requested) {
  require_descriptors(*wiring.scenario);
  LiveSession session(std::move(wiring), options, stop_requested);
  session.open();
  return session.run();
}

}  // namespace hil::run
