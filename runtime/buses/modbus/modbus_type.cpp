// The type of bus `modbus`.

#include "runtime/buses/bus.hpp"
#include "runtime/buses/modbus/modbus_record.hpp"
#include "runtime/buses/modbus/modbus_schema.hpp"
#include "runtime/buses/modbus/modbus_wiring.hpp"

namespace hil::buses {
namespace modbus {
namespace {

std::unique_ptr<BusWiring> wire_modbus(const config::BusSection& section, config::Diagnostics& diagnostics) {
  static_cast<void>(diagnostics);
  return std::make_unique<ModbusWiring>(dynamic_cast<const ModbusSection&>(section));
}

}  // namespace
}  // namespace modbus

BusType modbus_type() {
  return {.section = modbus::modbus_section_type(),
          .title = "Modbus",
          .columns = modbus::unit_columns(),
          .files = {{"Register map files", modbus::register_map_schema()}},
          .wire = modbus::wire_modbus};
}

}  // namespace hil::buses
