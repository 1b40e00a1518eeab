#include "runtime/buses/can/can_fault.hpp"

namespace hil::buses::can {

#define CAN_FAULT(name) config::FaultKind name##_can_fault();
#include "runtime/buses/can/faults/table.def"
#undef CAN_FAULT

const std::vector<config::FaultKind>& can_fault_kinds() {
#define CAN_FAULT(name) name##_can_fault(),
  static const std::vector<config::FaultKind> kinds{
#include "runtime/buses/can/faults/table.def"
  };
#undef CAN_FAULT
  return kinds;
}

}  // namespace hil::buses::can
