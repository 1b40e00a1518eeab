// The type of bus `can`.

#include "runtime/buses/bus.hpp"
#include "runtime/buses/can/can_description.hpp"
#include "runtime/buses/can/can_frame_format.hpp"
#include "runtime/buses/can/can_record.hpp"
#include "runtime/buses/can/can_wiring.hpp"
#include "runtime/buses/can/socketcan_lines.hpp"

namespace hil::buses {
namespace can {
namespace {

std::unique_ptr<BusWiring> wire_can(const config::BusSection& section, config::Diagnostics& diagnostics) {
  const auto& can_section = dynamic_cast<const CanSection&>(section);
  auto description = describe_can_device(can_section, diagnostics);
  if (!description) return nullptr;
  return std::make_unique<CanWiring>(can_section, std::move(*description));
}

}  // namespace
}  // namespace can

BusType can_type() {
  return {.section = can::can_section_type(),
          .title = "CAN",
          .columns = can::can_columns(),
          .frames = can::can_frame_format(),
          .wire = can::wire_can,
          .doctor_lines = can::socketcan_lines};
}

}  // namespace hil::buses
