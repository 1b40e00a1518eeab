// state: silent: no request of the unit is answered.

#include "runtime/buses/modbus/modbus_fault.hpp"

namespace hil::buses::modbus {
namespace {

class SilentUnitFault final : public ModbusFault {
 public:
  std::string sentence() const override { return "without replies"; }
  io::modbus::Interference interference() const override { return {.is_silent = true}; }
};

std::shared_ptr<const config::FaultEffect> read_silent(const config::Value& /*value*/,
                                                       const config::FaultContext& /*context*/) {
  return std::make_shared<const SilentUnitFault>();
}

}  // namespace

config::FaultKind silent_modbus_fault() {
  return {.target = config::FaultTarget::device,
          .key = "state",
          .word = "silent",
          .subject = "a Modbus unit",
          .about = "silent (no request is answered)",
          .read = read_silent};
}

}  // namespace hil::buses::modbus
