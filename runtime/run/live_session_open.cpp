#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <thread>

#include "io/can/socketcan_bus.hpp"
#include "runtime/config/world_limits.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/report_files.hpp"
#include "runtime/run/live_session.hpp"
#include "runtime/run/run_folder.hpp"
#include "runtime/run/run_record_parts.hpp"
#include "runtime/run/scenery.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t signal_log_rate_hz = 100;
/// What a short run leaves of its log at least: files are allocated ahead.
constexpr std::uint64_t log_segment_bytes = std::uint64_t{2} << 20;

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

}  // namespace

rtstdb::DurabilityOptions LiveSession::durability() const {
  static_assert(config::min_log_ring_bytes == rtstdb::min_ring_bytes &&
                config::max_log_ring_bytes == rtstdb::max_ring_bytes);
  const config::World& world = scenario_.world;
  rtstdb::DurabilityOptions options;
  if (world.durability == config::Durability::none) return options;
  options.directory = database_folder(options_.directory);
  options.mode = durability_mode(world.durability);
  options.flush_interval = rtstdb::Nanoseconds(world.flush_interval_ns);
  options.ring_bytes = world.log_ring_bytes;
  options.segment_bytes = log_segment_bytes;
  return options;
}

void LiveSession::write_world_record() const {
  contribution::WorldRecord record;
  record.scenario = scenario_.name;
  if (const std::uint64_t id = database_->durability().database_id; id != 0)
    record.database_id = report::id_text(id);
  record.period_ns = scenario_.base_period_ns;
  world_->describe(record);
  for (const WiredModule& wired : wiring_.modules)
    wired.module->describe(record.modules);
  try {
    report::write_world(record, options_.directory);
  } catch (const report::ReportError& error) {
    throw io::DeviceError(error.what());
  }
}

void LiveSession::open_world() {
  rtstdb::DatabaseOptions options;
  options.gpu = scenario_.world.gpu;
  options.max_entities = scenario_.world.max_entities;
  options.max_geometries = scenario_.world.max_geometries;
  options.retained_changes = scenario_.world.retained_changes;
  options.queue_capacity = scenario_.world.queue_capacity;
  options.chunk = rtstdb::Nanoseconds(scenario_.world.chunk_ns);
  options.clock = &database_clock_;
  options.durability = durability();
  if (!virtual_ && scenario_.realtime.scheduler == config::Scheduler::fifo)
    options.thread_priority = scenario_.realtime.priority;
  auto opened = rtstdb::Database::open(options);
  if (!opened && opened.error().code == rtstdb::ErrorCode::file)
    throw io::DeviceError(opened.error().message);
  if (!opened && opened.error().code == rtstdb::ErrorCode::out_of_memory)
    throw MemoryError(opened.error().message);
  if (!opened) throw GpuError(opened.error().message);
  database_ = std::move(opened).value();
  run_log_.info("GPU: " + database_->device().name + ", " + database_->device().driver);
  world_ = std::make_unique<modules::World>(*database_, wiring_.layers.names());
  create_scenery(scenario_, wiring_.scenery, *world_);
  for (WiredModule& wired : wiring_.modules) {
    const modules::TaskFacts facts = task_facts(scenario_, *wired.section);
    wired.module->configure(*world_, events_, facts);
    module_tasks_.push_back(std::make_unique<ModuleTask>(
        *wired.module, wired.links, facts.deadline_ns, wiring_.signals, *database_, device_clock_, events_));
  }
  write_world_record();
}

std::function<void()> LiveSession::thread_start(std::optional<int> priority, const std::string& who) {
  return [this, priority, who] {
    pthread_setname_np(pthread_self(), who.substr(0, 15).c_str());
    if (!priority) return;
    const sched_param parameters{.sched_priority = *priority};
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0)
      degraded_.add("SCHED_FIFO was refused for the thread of " + who + " (" + std::strerror(error) + ")");
  };
}

void LiveSession::open_buses() {
  for (const WiredCan& wired : wiring_.can) {
    const config::CanSection& section = *wired.section;
    Bus bus{.wired = &wired, .device = nullptr, .hub = nullptr, .stations = {}};
    std::size_t connections = 0;
    for (const config::ProcessSection& process : scenario_.processes) {
      if (!process.enabled) continue;
      Station station{&process, 0};
      for (const config::CommandWord& word : process.command) {
        for (const auto& placeholder : word.placeholders) {
          station.connections += placeholder.section == "can" && placeholder.name == section.bus.text ? 1 : 0;
        }
      }
      connections += station.connections;
      if (station.connections > 0) bus.stations.push_back(station);
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
                                     .expected_clients = connections};
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
    keep_judged_arrivals(bus);
    buses_.push_back(std::move(bus));
    buses_.back().device->start(device_clock_, pacing());
    run_log_.info("bus " + section.bus.text + ": " + address_of("can", section.bus.text));
  }
}

void LiveSession::keep_judged_arrivals(Bus& bus) {
  const std::vector<signals::SignalId>& inputs = bus.wired->links.inputs;
  for (const config::Expectation& expectation : scenario_.expectations) {
    const auto* response = std::get_if<config::Response>(&expectation.claim);
    if (response == nullptr) continue;
    for (const config::Word* word : {&response->request, &response->reply}) {
      const signals::SignalId signal = *wiring_.signals.find(word->text);
      const auto input = std::find(inputs.begin(), inputs.end(), signal);
      if (input == inputs.end()) continue;
      arrivals_.keep(*bus.device, static_cast<std::size_t>(input - inputs.begin()), signal);
    }
  }
}

void LiveSession::choose_ports() {
  for (const WiredModbus& wired : wiring_.modbus) {
    const config::ModbusSection& section = *wired.section;
    units_.push_back({.wired = &wired,
                      .endpoint = {.host = section.host, .port = section.port ? *section.port : free_port()},
                      .client = nullptr,
                      .server = nullptr});
  }
}

std::string LiveSession::address_of(const std::string& section, const std::string& name) const {
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

void LiveSession::start_processes() {
  std::vector<ProcessWatch::Program> programs;
  for (const config::ProcessSection& section : scenario_.processes) {
    if (!section.enabled) continue;
    ProcessWatch::Program program{
        .child = {.name = section.name.text,
                  .command = {},
                  .search_folders = options_.program_folders,
                  .working_folder = std::filesystem::path(scenario_.file).parent_path(),
                  .output_file = options_.directory / (section.name.text + ".out")},
        .safe_on_exit = section.safe_on_exit && !section.may_be_lost,
        .may_be_lost = section.may_be_lost};
    for (const config::CommandWord& word : section.command) {
      program.child.command.push_back(word.expand(
          [this](const std::string& kind, const std::string& name) { return address_of(kind, name); }));
    }
    programs.push_back(std::move(program));
  }
  processes_ = std::make_unique<ProcessWatch>(programs, [this] { return device_clock_.told_ns(); });
  for (const std::string& started : processes_->started())
    run_log_.info("started " + started);
}

/// Until every program that has a virtual bus's address has connected to it, as an ECU is powered before a
/// test begins.
void LiveSession::wait_for_stations() {
  const auto began = std::chrono::steady_clock::now();
  while (!outer_stop_->load()) {  // a run that is to stop ends with its first tick
    const std::int64_t waited_ns = (std::chrono::steady_clock::now() - began).count();
    bool complete = true;
    for (Bus& bus : buses_)
      complete = (bus.hub == nullptr || all_connected(bus, waited_ns)) && complete;
    if (complete) return;
    if (const std::string dead = processes_->first_dead(); !dead.empty()) {
      throw io::DeviceError("process " + dead + " before the run began; its output is in " +
                            options_.directory.string());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

/// Connections belong to a program by its process group, so that a script may start what connects. One that
/// is in no program's group (it left it) may be anyone's until the last limit has passed. Throws when a
/// program has not connected within its own limit.
bool LiveSession::all_connected(Bus& bus, std::int64_t waited_ns) {
  if (virtual_) bus.hub->take_in_clients();
  std::map<pid_t, std::size_t> connections;
  for (const io::virtual_bus::ClientCounters& client : bus.hub->client_counters()) {
    if (client.connected && (client.greeted || !virtual_)) ++connections[client.process_group];
  }
  struct Lack {
    const config::ProcessSection* program;
    std::size_t connections;
  };
  std::vector<Lack> lacks;
  std::size_t lacking = 0;
  std::int64_t last_limit_ns = 0;
  for (const Station& station : bus.stations) {
    std::size_t& own = connections[processes_->process_of(station.program->name.text)];
    last_limit_ns = std::max(last_limit_ns, station.program->start_timeout_ns);
    if (own < station.connections) {
      lacks.push_back({station.program, station.connections - own});
      lacking += station.connections - own;
    }
    own -= std::min(own, station.connections);
  }
  std::size_t of_nobody = 0;
  for (const auto& [group, count] : connections)
    of_nobody += count;
  if (lacking <= of_nobody) return true;
  for (const Lack& lack : lacks) {
    const std::int64_t limit_ns = lack.program->start_timeout_ns;
    const bool excused = lack.connections <= of_nobody && waited_ns < last_limit_ns;
    if (waited_ns < limit_ns || excused) continue;
    throw io::DeviceError("process " + lack.program->name.text + " did not connect to bus " +
                          bus.wired->section->bus.text + " within its start_timeout of " +
                          report::to_ascii(report::chosen_time(limit_ns)));
  }
  return false;
}

void LiveSession::open_modbus(io::modbus::Role role) {
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
    run_log_.info("unit " + section.unit.text + ": " + unit.endpoint.to_text());
  }
}

void LiveSession::open_clients() {
  try {
    open_modbus(io::modbus::Role::client);
  } catch (const io::DeviceError& error) {
    const std::string dead = processes_->first_dead();
    if (dead.empty()) throw;
    throw io::DeviceError("process " + dead + " before the run began; its output is in " +
                          options_.directory.string() + ". After that: " + error.what());
  }
}

/// Buses first, then units, as add_tasks takes them.
void LiveSession::link_devices() {
  std::vector<LossWatch::Subject> subjects;
  for (const Bus& bus : buses_) {
    links_.push_back(std::make_unique<DeviceLink>(*bus.device, bus.wired->links, wiring_.signals, pacing()));
    subjects.push_back({bus.device.get(), "CAN bus " + bus.device->name(), bus.wired->section->may_be_lost});
  }
  for (const Unit& unit : units_) {
    links_.push_back(
        std::make_unique<DeviceLink>(unit.device(), unit.wired->links, wiring_.signals, pacing()));
    subjects.push_back(
        {&unit.device(), "Modbus unit " + unit.device().name(), unit.wired->section->may_be_lost});
  }
  std::vector<const io::Device*> devices;
  for (const auto& link : links_)
    devices.push_back(&link->device());
  device_watch_.emplace(devices);
  loss_watch_.emplace(std::move(subjects));
}

void LiveSession::make_judges() {
  for (const config::Expectation& expectation : scenario_.expectations) {
    judges_.push_back(make_judge(expectation, wiring_.signals, arrivals_, scenario_.duration_ticks));
  }
  const double log_every = scenario_.base_rate_hz / static_cast<double>(signal_log_rate_hz);
  log_every_ticks_ = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(log_every));
  log_ = std::make_unique<SignalLog>(options_.directory / "signals.csv", wiring_.signals, virtual_);
}

}  // namespace hil::run
