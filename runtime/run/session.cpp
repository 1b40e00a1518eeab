#include "runtime/run/session.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <memory>
#include <mutex>
#include <thread>

#include "io/can/socketcan_bus.hpp"
#include "io/virtual/hub.hpp"
#include "runtime/executive/executive.hpp"
#include "runtime/run/expectations.hpp"
#include "runtime/run/process_watch.hpp"
#include "runtime/run/run_record_parts.hpp"
#include "runtime/run/scenery.hpp"
#include "runtime/run/signal_log.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t signal_log_rate_hz = 100;

/// A TCP port on loopback that nobody uses now.
std::uint16_t free_port() {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool ok = fd >= 0 && bind(fd, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  if (fd >= 0) close(fd);
  if (!ok) throw io::DeviceError(std::string("no free TCP port on loopback: ") + std::strerror(errno));
  return ntohs(address.sin_port);
}

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

/// Sentences that threads add while the run goes on.
class Sentences {
 public:
  void add(const std::string& sentence) {
    const std::lock_guard lock(mutex_);
    if (std::find(all_.begin(), all_.end(), sentence) == all_.end()) all_.push_back(sentence);
  }
  std::vector<std::string> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> all_;
};

class Session final : public executive::TickHooks {
 public:
  Session(Wiring wiring, const SessionOptions& options)
      : wiring_(std::move(wiring)),
        scenario_(*wiring_.scenario),
        options_(options),
        virtual_(scenario_.clock == config::ClockKind::virtual_time),
        database_clock_(clock()),
        device_clock_(clock()) {
    std::filesystem::create_directories(options.directory);
  }
  ~Session() override { close_devices(); }

  void open(const std::atomic<bool>& stop_requested) {
    outer_stop_ = &stop_requested;
    open_world();
    open_buses();
    choose_ports();
    open_modbus(io::modbus::Role::server);  // programs may be its clients
    start_processes();
    wait_for_stations();
    open_modbus(io::modbus::Role::client);
    link_devices();
    make_judges();
  }

  SessionResult run(const std::atomic<bool>& stop_requested);

  void before_first_tick(std::int64_t start_ns) noexcept override { device_clock_.set_origin(start_ns); }
  void begin_tick(const executive::TickInfo& /*tick*/) noexcept override {
    for (const auto& link : links_)
      link->latch_inputs();
  }
  void end_tick(const executive::TickInfo& tick) noexcept override {
    for (const auto& judge : judges_)
      judge->look(wiring_.signals, tick.time_ns);
    if (tick.tick % log_every_ticks_ == 0) log_->take(wiring_.signals, tick.time_ns);
    bool in_step = true;
    for (const auto& link : links_)
      in_step = in_step && link->in_step();
    if (!in_step || outer_stop_->load(std::memory_order_relaxed)) {
      stop_.store(true, std::memory_order_relaxed);
    }
  }

 private:
  executive::Clock& clock() noexcept {
    return virtual_ ? static_cast<executive::Clock&>(virtual_clock_)
                    : static_cast<executive::Clock&>(monotonic_clock_);
  }
  io::Pacing pacing() const noexcept { return virtual_ ? io::Pacing::lockstep : io::Pacing::realtime; }

  void open_world();
  void open_buses();
  void choose_ports();
  void start_processes();
  void wait_for_stations();
  void open_modbus(io::modbus::Role role);
  void link_devices();
  void make_judges();
  void close_devices() noexcept;
  std::function<void()> thread_start(std::optional<int> priority, const std::string& who);
  /// What stands for {section.name} in a command.
  std::string address_of(const std::string& section, const std::string& name) const;
  void add_tasks(executive::Executive& executive);
  report::LiveStatus live_status(const executive::Executive& executive);
  void fill_record(const executive::RunResult& result, bool interrupted, report::RunRecord& record);
  void decide(const executive::RunResult& result, bool interrupted, report::RunRecord& record) const;
  std::string io_fault() const;

  Wiring wiring_;
  const config::Scenario& scenario_;
  const SessionOptions& options_;
  const bool virtual_;
  executive::MonotonicClock monotonic_clock_;
  executive::VirtualClock virtual_clock_;
  DatabaseClock database_clock_;
  DeviceClock device_clock_;
  Sentences degraded_;

  std::unique_ptr<rtstdb::Database> database_;
  std::unique_ptr<modules::World> world_;
  modules::EventLog events_;
  std::vector<std::unique_ptr<ModuleTask>> module_tasks_;

  struct Bus {
    const WiredCan* wired = nullptr;
    std::unique_ptr<io::can::CanDevice> device;
    const io::virtual_bus::Hub* hub = nullptr;  // of a virtual bus
    std::size_t stations = 0;                   // programs that connect to it
  };
  std::vector<Bus> buses_;
  struct Unit {
    const WiredModbus* wired = nullptr;
    io::modbus::Endpoint endpoint;
    std::unique_ptr<io::modbus::ClientDevice> client;
    std::unique_ptr<io::modbus::ServerDevice> server;
    io::Device& device() const {
      return client ? static_cast<io::Device&>(*client) : static_cast<io::Device&>(*server);
    }
  };
  std::vector<Unit> units_;
  std::vector<std::unique_ptr<DeviceLink>> links_;
  std::unique_ptr<ProcessWatch> processes_;
  std::vector<ProcessFate> fates_;

  std::vector<std::unique_ptr<Judge>> judges_;
  std::unique_ptr<SignalLog> log_;
  std::string log_fault_;
  std::uint64_t log_every_ticks_ = 1;

  std::atomic<bool> stop_{false};
  const std::atomic<bool>* outer_stop_ = nullptr;
  std::atomic<bool> process_lost_{false};
  std::uint64_t last_live_ticks_ = 0;
};

void Session::open_world() {
  rtstdb::DatabaseOptions options;
  options.gpu = scenario_.world.gpu;
  options.max_entities = scenario_.world.max_entities;
  options.max_geometries = scenario_.world.max_geometries;
  options.retained_changes = scenario_.world.retained_changes;
  options.queue_capacity = scenario_.world.queue_capacity;
  options.clock = &database_clock_;
  if (!virtual_ && scenario_.realtime.scheduler == config::Scheduler::fifo)
    options.thread_priority = scenario_.realtime.priority;
  auto opened = rtstdb::Database::open(options);
  if (!opened) throw GpuError(opened.error().message);
  database_ = std::move(opened).value();
  world_ = std::make_unique<modules::World>(*database_, scenario_.world.layers.names());
  create_scenery(scenario_, *world_);
  for (WiredModule& wired : wiring_.modules) {
    const config::TaskSection& section = *wired.section;
    const std::int64_t period_ns = scenario_.base_period_ns * section.every_ticks;
    const modules::TaskFacts facts{.instance = section.module.text,
                                   .period_ns = period_ns,
                                   .deadline_ns = section.deadline_ns == 0 ? period_ns : section.deadline_ns,
                                   .seed = scenario_.seed,
                                   .own_thread = !section.thread.empty()};
    wired.module->configure(*world_, events_, facts);
    module_tasks_.push_back(std::make_unique<ModuleTask>(
        *wired.module, wired.links, facts.deadline_ns, wiring_.signals, *database_, device_clock_, events_));
  }
}

std::function<void()> Session::thread_start(std::optional<int> priority, const std::string& who) {
  return [this, priority, who] {
    pthread_setname_np(pthread_self(), who.substr(0, 15).c_str());
    if (!priority) return;
    const sched_param parameters{.sched_priority = *priority};
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0)
      degraded_.add("SCHED_FIFO was refused for the thread of " + who + " (" + std::strerror(error) + ")");
  };
}

void Session::open_buses() {
  for (const WiredCan& wired : wiring_.can) {
    const config::CanSection& section = *wired.section;
    Bus bus{.wired = &wired, .device = nullptr, .hub = nullptr, .stations = 0};
    for (const config::ProcessSection& process : scenario_.processes) {
      if (!process.enabled) continue;
      for (const config::CommandWord& word : process.command) {
        for (const auto& placeholder : word.placeholders) {
          bus.stations += placeholder.section == "can" && placeholder.name == section.bus.text ? 1 : 0;
        }
      }
    }
    std::unique_ptr<io::can::Bus> port;
    if (section.is_virtual()) {
      io::virtual_bus::HubConfig hub{.name = section.bus.text,
                                     .path = {},
                                     .faults = {.drop_probability = section.faults.drop,
                                                .corrupt_probability = section.faults.corrupt,
                                                .delay_probability = section.faults.delay_ns > 0 ? 1.0 : 0.0,
                                                .delay_ns = section.faults.delay_ns,
                                                .seed = scenario_.seed},
                                     .expected_clients = bus.stations};
      auto made = std::make_unique<io::virtual_bus::Hub>(std::move(hub));
      bus.hub = made.get();
      port = std::move(made);
    } else {
      port =
          std::make_unique<io::can::SocketCanBus>(io::can::SocketCanConfig{.interface = section.interface});
    }
    io::can::CanDeviceConfig config = wired.device;
    config.log_file = options_.directory / ("can-" + section.bus.text + ".log");
    config.on_thread_start = thread_start(section.thread_priority, "can " + section.bus.text);
    bus.device = std::make_unique<io::can::CanDevice>(std::move(config), std::move(port));
    buses_.push_back(std::move(bus));
    buses_.back().device->start(device_clock_, pacing());
  }
}

void Session::choose_ports() {
  for (const WiredModbus& wired : wiring_.modbus) {
    const config::ModbusSection& section = *wired.section;
    units_.push_back({.wired = &wired,
                      .endpoint = {.host = section.host, .port = section.port ? *section.port : free_port()},
                      .client = nullptr,
                      .server = nullptr});
  }
}

std::string Session::address_of(const std::string& section, const std::string& name) const {
  if (section == "clock") return virtual_ ? "stepped" : "wall";
  if (section == "can") {
    for (const Bus& bus : buses_) {
      if (bus.wired->section->bus.text != name) continue;
      return bus.hub != nullptr ? bus.hub->address() : "socketcan:" + bus.wired->section->interface;
    }
  }
  for (const Unit& unit : units_) {
    if (unit.wired->section->unit.text == name) return unit.endpoint.to_text();
  }
  return {};
}

void Session::start_processes() {
  std::vector<ProcessWatch::Program> programs;
  for (const config::ProcessSection& section : scenario_.processes) {
    if (!section.enabled) continue;
    ProcessWatch::Program program{
        .child = {.name = section.name.text,
                  .command = {},
                  .search_folders = options_.program_folders,
                  .working_folder = std::filesystem::path(scenario_.file).parent_path(),
                  .output_file = options_.directory / (section.name.text + ".out")},
        .safe_on_exit = section.safe_on_exit};
    for (const config::CommandWord& word : section.command) {
      program.child.command.push_back(word.expand(
          [this](const std::string& kind, const std::string& name) { return address_of(kind, name); }));
    }
    programs.push_back(std::move(program));
  }
  processes_ = std::make_unique<ProcessWatch>(programs, [this] { return device_clock_.now_ns(); });
}

/// In real time: until every program that has a bus's address has connected to it, as an ECU is powered
/// before a test begins. In lock-step the hub's first barrier waits.
void Session::wait_for_stations() {
  if (virtual_) return;
  std::int64_t limit_ns = 0;
  for (const config::ProcessSection& section : scenario_.processes) {
    if (section.enabled) limit_ns = std::max(limit_ns, section.start_timeout_ns);
  }
  const auto until = std::chrono::steady_clock::now() + std::chrono::nanoseconds(limit_ns);
  for (const Bus& bus : buses_) {
    while (bus.hub != nullptr && bus.hub->station_count() < bus.stations) {
      if (outer_stop_->load()) return;  // the run then ends with its first tick
      if (const std::string dead = processes_->first_dead(); !dead.empty()) {
        throw io::DeviceError("process " + dead + " before the run began; its output is in " +
                              options_.directory.string());
      }
      if (std::chrono::steady_clock::now() >= until) {
        throw io::DeviceError("only " + std::to_string(bus.hub->station_count()) + " of " +
                              std::to_string(bus.stations) + " programs connected to bus " +
                              bus.wired->section->bus.text + " within their start_timeout");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
}

void Session::open_modbus(io::modbus::Role role) {
  for (Unit& unit : units_) {
    const config::ModbusSection& section = *unit.wired->section;
    if (section.role != role) continue;
    if (role == io::modbus::Role::client) {
      unit.client = std::make_unique<io::modbus::ClientDevice>(client_settings(section, unit.endpoint),
                                                               section.registers);
    } else {
      unit.server = std::make_unique<io::modbus::ServerDevice>(server_settings(section, unit.endpoint),
                                                               section.registers);
    }
    unit.device().start(device_clock_, pacing());
  }
}

/// Buses first, then units, as add_tasks takes them.
void Session::link_devices() {
  for (const Bus& bus : buses_) {
    links_.push_back(std::make_unique<DeviceLink>(*bus.device, bus.wired->links, wiring_.signals, pacing()));
  }
  for (const Unit& unit : units_) {
    links_.push_back(
        std::make_unique<DeviceLink>(unit.device(), unit.wired->links, wiring_.signals, pacing()));
  }
}

void Session::make_judges() {
  for (const config::Expectation& expectation : scenario_.expectations) {
    judges_.push_back(make_judge(expectation, wiring_.signals, scenario_.duration_ticks));
  }
  const double log_every = scenario_.base_rate_hz / static_cast<double>(signal_log_rate_hz);
  log_every_ticks_ = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(log_every));
  log_ = std::make_unique<SignalLog>(options_.directory / "signals.csv", wiring_.signals, virtual_);
}

void Session::add_tasks(executive::Executive& executive) {
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

report::LiveStatus Session::live_status(const executive::Executive& executive) {
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

void Session::close_devices() noexcept {
  if (processes_) processes_->end_watch();
  // Safe values go out before anything closes.
  for (const auto& link : links_)
    link->device().enter_safe_state();
  for (const auto& link : links_)
    link->device().stop();
  if (processes_) fates_ = processes_->stop();
  processes_.reset();
}

SessionResult Session::run(const std::atomic<bool>& stop_requested) {
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
  };
  executive::Executive executive(options);
  add_tasks(executive);
  processes_->watch(
      [this](const ProcessFate& fate) {
        if (!fate.safe_on_exit) return;
        process_lost_.store(true);
        for (const auto& link : links_)
          link->device().enter_safe_state();
        stop_.store(true);
      },
      [this, &executive] {
        if (database_->health().device_lost) stop_.store(true);
        if (options_.every_second) options_.every_second(live_status(executive));
      });
  SessionResult session;
  report::RunRecord& record = session.record;
  record.started_at = utc_now();
  const auto began = std::chrono::steady_clock::now();
  const executive::RunResult result = executive.run(stop_);
  record.wall_ns = (std::chrono::steady_clock::now() - began).count();
  const std::string fault = io_fault();
  close_devices();
  log_fault_ = log_->close();
  const bool interrupted = result.stopped && stop_requested.load();
  if (!fault.empty()) record.reason = fault;
  fill_record(result, interrupted, record);
  session.trace = trace_of(result, record.events);
  return session;
}

std::string Session::io_fault() const {
  for (const auto& link : links_) {
    if (link->in_step()) continue;
    const std::string fault = link->device().health().fault;
    return "device " + link->device().name() + " fell out of step: " + (fault.empty() ? "no answer" : fault);
  }
  return {};
}

void Session::fill_record(const executive::RunResult& result, bool interrupted, report::RunRecord& record) {
  record.scenario = {scenario_.name, scenario_.file, scenario_.about};
  record.clock = virtual_ ? "virtual" : "realtime";
  record.duration_ns = scenario_.duration_ns;
  record.seed = scenario_.seed;
  record.overrides = options_.overrides;
  record.program_version = HIL_VERSION;
  take_executive(result, scenario_, record);
  record.realtime.kernel = kernel_words();
  const rtstdb::DeviceInfo& device = database_->device();
  record.gpu = {device.name, device.driver, device.api};
  for (const std::string& sentence : degraded_.all())
    record.realtime.degraded.push_back(sentence);
  for (const std::string& sentence : database_->health().degraded)
    record.realtime.degraded.push_back(sentence);
  record.transactions = transactions_of(database_->counts());
  for (const Bus& bus : buses_)
    record.can.push_back(can_bus_of(*bus.device));
  for (const Unit& unit : units_) {
    record.modbus.push_back(unit.client ? modbus_unit_of(*unit.client) : modbus_unit_of(*unit.server));
  }
  for (const ProcessFate& fate : fates_) {
    record.processes.push_back({fate.name, fate.command, fate.exit,
                                fate.ended_early ? std::optional(fate.ended_at_ns) : std::nullopt});
  }
  for (const auto& judge : judges_) {
    record.expectations.push_back(judge->result(result.run_time_ns));
    if (auto times = judge->response_times(result.run_time_ns))
      record.response_times.push_back(std::move(*times));
  }
  for (const modules::EventLog::Event& event : events_.events())
    record.events.push_back({event.time_ns, event.text});
  for (const ProcessFate& fate : fates_) {
    if (fate.ended_early)
      record.events.push_back({fate.ended_at_ns, "process " + fate.name + " " + fate.exit});
  }
  std::stable_sort(record.events.begin(), record.events.end(),
                   [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
  record.top_view.emplace();
  record.top_view->time_ns = result.run_time_ns;
  record.top_view->shapes = outlines(scenario_);
  for (const WiredModule& wired : wiring_.modules)
    wired.module->contribute(record);
  if (log_->lost_rows() > 0) {
    record.realtime.degraded.push_back("signals.csv lacks " + std::to_string(log_->lost_rows()) +
                                       " rows: the disk was too slow");
  }
  if (events_.lost() > 0) {
    record.realtime.degraded.push_back("the event list lacks " + std::to_string(events_.lost()) +
                                       " events: it was full");
  }
  decide(result, interrupted, record);
}

void Session::decide(const executive::RunResult& result, bool interrupted, report::RunRecord& record) const {
  const auto conclude = [&](report::Verdict verdict, int exit_code, std::string reason) {
    record.verdict = verdict;
    record.exit_code = exit_code;
    record.reason = std::move(reason);
  };
  if (database_->health().device_lost) {
    conclude(report::Verdict::gpu_failed, exit_gpu_failed, "the GPU stopped answering");
    return;
  }
  if (process_lost_.load()) {
    for (const ProcessFate& fate : fates_) {
      if (!fate.ended_early || !fate.safe_on_exit) continue;
      conclude(report::Verdict::io_failed, exit_io_failed,
               "process " + fate.name + " " + fate.exit +
                   " before the run was over; outputs were set to their safe values");
      return;
    }
  }
  if (!record.reason.empty()) {
    conclude(report::Verdict::io_failed, exit_io_failed, record.reason);
    return;
  }
  if (!log_fault_.empty()) {
    conclude(report::Verdict::io_failed, exit_io_failed, log_fault_);
    return;
  }
  if (result.hang) {
    conclude(report::Verdict::timing_broken, exit_timing_broken, record.watchdog.front().text);
    return;
  }
  if (options_.fail_on && timing_broken(*options_.fail_on, result, record.transactions)) {
    conclude(report::Verdict::timing_broken, exit_timing_broken,
             "--fail-on '" + options_.fail_on->text() + "' came true");
    return;
  }
  if (interrupted) {
    conclude(report::Verdict::interrupted, exit_interrupted,
             "interrupted after " + std::to_string(result.ticks) + " ticks");
    return;
  }
  for (const report::Expectation& expectation : record.expectations) {
    if (expectation.passed) continue;
    conclude(report::Verdict::failed, exit_expectation_failed,
             "expectation '" + expectation.name + "' failed: " + expectation.detail);
    return;
  }
  conclude(report::Verdict::passed, exit_passed,
           record.expectations.empty() ? "the scenario expects nothing" : "every expectation held");
}

}  // namespace

SessionResult run_session(Wiring wiring, const SessionOptions& options,
                          const std::atomic<bool>& stop_requested) {
  Session session(std::move(wiring), options);
  session.open(stop_requested);
  return session.run(stop_requested);
}

}  // namespace hil::run
