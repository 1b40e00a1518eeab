#pragma once
// A CAN bus in a run: its device, and the hub and the programs of a virtual bus.

#include <memory>
#include <optional>
#include <string>

#include "io/can/can_device.hpp"
#include "io/virtual/hub.hpp"
#include "runtime/buses/bus.hpp"
#include "runtime/buses/can/can_section.hpp"
#include "runtime/buses/can/connected_programs.hpp"

namespace hil::buses::can {

class CanBusDevice final : public BusDevice {
 public:
  /// The section outlives it. Throws io::DeviceError.
  CanBusDevice(const CanSection& section, io::can::CanDeviceConfig config, RunEnvironment environment);

  io::Device& device() noexcept override { return *device_; }
  void add_fault(const InjectedFault& fault) override;
  StartPhase start_phase() const noexcept override { return StartPhase::before_programs; }
  std::string address() const override;
  bool all_programs_connected(const StartedPrograms& programs) const override;
  std::optional<double> load() const override { return device_->counters().bus_load; }
  contribution::BusRecord record() const override;
  std::optional<PlaybackRecord> playback() const override;
  std::string log_file() const override;
  std::string log_fault() const override;

 private:
  const CanSection& section_;
  ConnectedPrograms programs_;
  std::unique_ptr<io::can::CanDevice> device_;
  io::virtual_bus::Hub* hub_ = nullptr;  ///< of a virtual bus; the device owns it
};

}  // namespace hil::buses::can
