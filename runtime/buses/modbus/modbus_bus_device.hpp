#pragma once
// A Modbus unit in a run: its device, and the endpoint that it uses.

#include <memory>
#include <string>

#include "io/modbus/client_device.hpp"
#include "io/modbus/server_device.hpp"
#include "runtime/buses/bus.hpp"
#include "runtime/buses/modbus/modbus_section.hpp"

namespace hil::buses::modbus {

class ModbusBusDevice final : public BusDevice {
 public:
  /// Chooses a free port when the section leaves it open; throws io::DeviceError when there is none.
  ModbusBusDevice(const ModbusSection& section, RunEnvironment environment);

  io::Device& device() noexcept override;
  void add_fault(const InjectedFault& fault) override;
  /// Programs may be clients of a server.
  StartPhase start_phase() const noexcept override {
    return server_ ? StartPhase::before_programs : StartPhase::after_programs;
  }
  std::string address() const override { return endpoint_.to_text(); }
  contribution::BusRecord record() const override;

 private:
  io::modbus::Endpoint endpoint_;
  // One of them.
  std::unique_ptr<io::modbus::ClientDevice> client_;
  std::unique_ptr<io::modbus::ServerDevice> server_;
};

}  // namespace hil::buses::modbus
