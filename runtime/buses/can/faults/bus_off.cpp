// state: bus_off: the bus neither sends nor receives.

#include "runtime/buses/can/can_fault.hpp"

namespace hil::buses::can {
namespace {

class BusOffFault final : public CanFault {
 public:
  std::string sentence() const override { return "bus-off"; }
  std::string problem(const io::can::CanDevice& /*device*/, const std::string& /*message*/) const override {
    return {};
  }
  void add_to(io::can::CanDevice& device, const std::string& /*message*/,
              std::uint64_t /*seed*/) const override {
    device.add_bus_off();
  }
};

std::shared_ptr<const config::FaultEffect> read_bus_off(const config::Value& /*value*/,
                                                        const config::FaultContext& /*context*/) {
  return std::make_shared<const BusOffFault>();
}

}  // namespace

config::FaultKind bus_off_can_fault() {
  return {.target = config::FaultTarget::device,
          .key = "state",
          .word = "bus_off",
          .subject = "a CAN bus",
          .about = "bus_off",
          .read = read_bus_off};
}

}  // namespace hil::buses::can
