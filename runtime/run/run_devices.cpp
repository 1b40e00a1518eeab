#include "runtime/run/run_devices.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <variant>

#include "io/can/socketcan_bus.hpp"
#include "runtime/run/run_record_parts.hpp"

namespace hil::run {
namespace {

/// A TCP port on loopback that no program uses now.
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

io::virtual_bus::HubConfig hub_config(const config::CanSection& section, std::uint64_t seed,
                                      std::size_t connection_count) {
  return {.name = section.bus.text,
          .path = {},
          .faults = {.drop_probability = section.faults.drop,
                     .corrupt_probability = section.faults.corrupt,
                     .delay_probability = section.faults.delay_ns > 0 ? 1.0 : 0.0,
                     .delay_ns = section.faults.delay_ns,
                     .seed = seed},
          .expected_clients = connection_count};
}

}  // namespace

std::function<void()> RunDevices::thread_start(std::optional<int> priority, const std::string& name) {
  return [this, priority, name] {
    pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
    if (!priority) return;
    const sched_param parameters{.sched_priority = *priority};
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0) {
      context_.degraded.add("SCHED_FIFO was refused for the thread of " + name + " (" + std::strerror(error) +
                            ")");
    }
  };
}

void RunDevices::open_buses() {
  for (const WiredCan& wired : wiring_.can) {
    const config::CanSection& section = *wired.section;
    Bus bus{.wired = &wired,
            .device = nullptr,
            .hub = nullptr,
            .stations = BusStations(context_.scenario, section)};
    std::unique_ptr<io::can::Bus> port;
    if (section.is_virtual()) {
      auto hub = std::make_unique<io::virtual_bus::Hub>(
          hub_config(section, context_.scenario.seed, bus.stations.connection_count()));
      bus.hub = hub.get();
      port = std::move(hub);
    } else {
      port =
          std::make_unique<io::can::SocketCanBus>(io::can::SocketCanConfig{.interface = section.interface});
    }
    io::can::CanDeviceConfig config = wired.device;
    config.log_file = context_.options.directory / ("can-" + section.bus.text + ".log");
    config.on_thread_start = thread_start(section.thread_priority, "can " + section.bus.text);
    bus.device = std::make_unique<io::can::CanDevice>(std::move(config), std::move(port));
    keep_judged_arrivals(bus);
    buses_.push_back(std::move(bus));
    buses_.back().device->start(context_.device_clock, context_.pacing());
    context_.log.info("bus " + section.bus.text + ": " + address_of("can", section.bus.text));
  }
}

void RunDevices::keep_judged_arrivals(Bus& bus) {
  const std::vector<signals::SignalId>& inputs = bus.wired->links.inputs;
  for (const config::Expectation& expectation : context_.scenario.expectations) {
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

void RunDevices::choose_ports() {
  for (const WiredModbus& wired : wiring_.modbus) {
    const config::ModbusSection& section = *wired.section;
    units_.push_back({.wired = &wired,
                      .endpoint = {.host = section.host, .port = section.port ? *section.port : free_port()},
                      .client = nullptr,
                      .server = nullptr});
  }
}

void RunDevices::open_units(io::modbus::Role role) {
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
    unit.device().start(context_.device_clock, context_.pacing());
    context_.log.info("unit " + section.unit.text + ": " + unit.endpoint.to_text());
  }
}

bool RunDevices::all_stations_connected(const ProcessWatch& processes, std::int64_t waited_ns) const {
  bool complete = true;
  for (const Bus& bus : buses_) {
    const bool connected = bus.hub == nullptr || bus.stations.all_connected(*bus.hub, processes, waited_ns);
    complete = connected && complete;
  }
  return complete;
}

void RunDevices::link() {
  std::vector<LossWatch::Subject> subjects;
  for (const Bus& bus : buses_) {
    links_.push_back(
        std::make_unique<DeviceLink>(*bus.device, bus.wired->links, wiring_.signals, context_.pacing()));
    subjects.push_back({bus.device.get(), "CAN bus " + bus.device->name(), bus.wired->section->may_be_lost});
  }
  for (const Unit& unit : units_) {
    links_.push_back(
        std::make_unique<DeviceLink>(unit.device(), unit.wired->links, wiring_.signals, context_.pacing()));
    subjects.push_back(
        {&unit.device(), "Modbus unit " + unit.device().name(), unit.wired->section->may_be_lost});
  }
  std::vector<const io::Device*> devices;
  for (const auto& link : links_)
    devices.push_back(&link->device());
  device_watch_.emplace(devices);
  loss_watch_.emplace(std::move(subjects));
}

std::string RunDevices::address_of(const std::string& section, const std::string& name) const {
  if (section == "clock") return context_.is_virtual ? "stepped" : "wall";
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

void RunDevices::add_tasks(executive::Executive& executive) {
  auto link = links_.begin();
  const auto add = [&](const std::string& name, std::uint32_t every_ticks) {
    executive.add_task({.name = name, .every_ticks = every_ticks, .thread = {}}, **link++);
  };
  for (const Bus& bus : buses_)
    add("can." + bus.wired->section->bus.text, bus.wired->section->every_ticks);
  for (const Unit& unit : units_)
    add("modbus." + unit.wired->section->unit.text, unit.wired->section->every_ticks);
}

void RunDevices::begin_tick(std::int64_t time_ns) noexcept {
  for (const auto& link : links_)
    link->latch_inputs(time_ns);
  loss_watch_->check(time_ns);
  for (const auto& link : links_)
    link->hold_safe_values(loss_watch_->outputs_must_be_safe());
}

bool RunDevices::in_step() const noexcept {
  return std::all_of(links_.begin(), links_.end(), [](const auto& link) { return link->in_step(); });
}

std::string RunDevices::step_fault() const {
  for (const auto& link : links_) {
    if (link->in_step()) continue;
    const std::string fault = link->device().fault();
    return "device " + link->device().name() + " fell out of step: " + (fault.empty() ? "no answer" : fault);
  }
  return {};
}

void RunDevices::check() {
  device_watch_->check(context_.device_clock.report_ns(), [this](bool good, const std::string& sentence) {
    good ? context_.log.info(sentence) : context_.log.warn(sentence);
  });
}

std::vector<report::LiveBus> RunDevices::bus_loads() const {
  std::vector<report::LiveBus> loads;
  for (const Bus& bus : buses_)
    loads.push_back({bus.wired->section->bus.text, bus.device->counters().bus_load});
  return loads;
}

void RunDevices::enter_safe_state() noexcept {
  for (const auto& link : links_)
    link->device().enter_safe_state();
}

void RunDevices::stop() noexcept {
  enter_safe_state();
  for (const auto& link : links_)
    link->device().stop();
}

void RunDevices::take_last_events() {
  device_watch_->take_last_events([this](const std::string& sentence) { context_.log.warn(sentence); });
}

void RunDevices::fill(report::RunRecord& record) const {
  for (const Bus& bus : buses_)
    record.can.push_back(can_bus_of(*bus.device));
  for (const Unit& unit : units_)
    record.modbus.push_back(unit.client ? modbus_unit_of(*unit.client) : modbus_unit_of(*unit.server));
}

std::vector<std::string> RunDevices::send_faults() const {
  std::vector<std::string> faults;
  for (const auto& link : links_) {
    if (std::string fault = link->device().send_fault(); !fault.empty()) faults.push_back(std::move(fault));
  }
  return faults;
}

std::vector<std::string> RunDevices::log_files() const {
  std::vector<std::string> files;
  for (const Bus& bus : buses_)
    files.push_back("can-" + bus.device->name() + ".log");
  return files;
}

std::vector<std::string> RunDevices::log_faults() const {
  std::vector<std::string> faults;
  for (const Bus& bus : buses_) {
    const std::uint64_t frames = bus.device->counters().log_dropped;
    if (const std::string fault = bus.device->log_fault(); !fault.empty()) {
      faults.push_back(fault);
    } else if (frames > 0) {
      faults.push_back("can-" + bus.device->name() + ".log lacks " + std::to_string(frames) +
                       " frames: the disk was too slow");
    }
  }
  return faults;
}

}  // namespace hil::run
