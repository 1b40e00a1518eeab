// state: disconnected: there is no connection with the unit.

#include "runtime/buses/modbus/modbus_fault.hpp"

namespace hil::buses::modbus {
namespace {

class DisconnectedUnitFault final : public ModbusFault {
 public:
  std::string sentence() const override { return "disconnected"; }
  io::modbus::Interference interference() const override { return {.is_disconnected = true}; }
};

std::shared_ptr<const config::FaultEffect> read_disconnected(const config::Value& /*value*/,
                                                             const config::FaultContext& /*context*/) {
  return std::make_shared<const DisconnectedUnitFault>();
}

}  // namespace

config::FaultKind disconnected_modbus_fault() {
  return {.target = config::FaultTarget::device,
          .key = "state",
          .word = "disconnected",
          .subject = "a Modbus unit",
          .about = "disconnected",
          .read = read_disconnected};
}

}  // namespace hil::buses::modbus
