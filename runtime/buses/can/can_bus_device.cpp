#include "runtime/buses/can/can_bus_device.hpp"

#include <utility>

#include "io/can/socketcan_bus.hpp"
#include "runtime/buses/can/can_fault.hpp"
#include "runtime/buses/can/can_record.hpp"

namespace hil::buses::can {
namespace {

io::virtual_bus::HubConfig hub_config(const CanSection& section, std::uint64_t seed,
                                      std::size_t connection_count) {
  return {.name = section.name.text,
          .path = {},
          .faults = {.drop_probability = section.faults.drop,
                     .corrupt_probability = section.faults.corrupt,
                     .delay_probability = section.faults.delay_ns > 0 ? 1.0 : 0.0,
                     .delay_ns = section.faults.delay_ns,
                     .seed = seed},
          .expected_stations = connection_count};
}

}  // namespace

CanBusDevice::CanBusDevice(const CanSection& section, io::can::CanDeviceConfig config,
                           RunEnvironment environment)
    : section_(section), programs_(environment.scenario, section) {
  std::unique_ptr<io::can::CanTransport> port;
  if (section.is_virtual()) {
    auto hub = std::make_unique<io::virtual_bus::Hub>(
        hub_config(section, environment.scenario.seed, programs_.connection_count()));
    hub_ = hub.get();
    port = std::move(hub);
  } else {
    port = std::make_unique<io::can::SocketCanBus>(io::can::SocketCanConfig{.interface = section.interface});
  }
  config.log_file = environment.directory / log_file();
  config.frames = environment.frames;
  config.on_thread_start = std::move(environment.on_thread_start);
  device_ = std::make_unique<io::can::CanDevice>(std::move(config), std::move(port));
}

void CanBusDevice::add_fault(const InjectedFault& fault) {
  dynamic_cast<const CanFault&>(*fault.effect).add_to(*device_, fault.message, fault.seed);
}

std::string CanBusDevice::address() const {
  return hub_ != nullptr ? hub_->address() : "socketcan:" + section_.interface;
}

bool CanBusDevice::all_programs_connected(const StartedPrograms& programs) const {
  return hub_ == nullptr || programs_.all_connected(*hub_, programs);
}

contribution::BusRecord CanBusDevice::record() const {
  return to_record(record_of(*device_));
}

std::optional<PlaybackRecord> CanBusDevice::playback() const {
  const std::optional<io::can::PlaybackState> playback = device_->playback();
  if (!playback) return std::nullopt;
  return PlaybackRecord{.file = playback->name,
                        .passes = playback->first_ns ? playback->passes : 0,
                        .first_begin_ns = playback->first_ns,
                        .end_ns = playback->last_ns,
                        .frames = playback->sent};
}

std::string CanBusDevice::log_file() const {
  return "can-" + section_.name.text + ".log";
}

std::string CanBusDevice::log_fault() const {
  if (std::string fault = device_->log_fault(); !fault.empty()) return fault;
  const std::uint64_t frames = device_->counters().log_dropped;
  if (frames == 0) return {};
  return log_file() + " lacks " + std::to_string(frames) + " frames: the disk was too slow";
}

}  // namespace hil::buses::can
