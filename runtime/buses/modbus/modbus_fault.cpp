#include "runtime/buses/modbus/modbus_fault.hpp"

namespace hil::buses::modbus {

#define MODBUS_FAULT(name) config::FaultKind name##_modbus_fault();
#include "runtime/buses/modbus/faults/table.def"
#undef MODBUS_FAULT

const std::vector<config::FaultKind>& modbus_fault_kinds() {
#define MODBUS_FAULT(name) name##_modbus_fault(),
  static const std::vector<config::FaultKind> kinds{
#include "runtime/buses/modbus/faults/table.def"
  };
#undef MODBUS_FAULT
  return kinds;
}

}  // namespace hil::buses::modbus
