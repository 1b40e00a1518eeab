#pragma once
// The kinds of fault of a Modbus unit (faults/table.def), and the port between a unit and a kind.
//
// Threads: immutable; any.

#include <vector>

#include "io/modbus/unit_faults.hpp"
#include "runtime/config/fault_section.hpp"

namespace hil::buses::modbus {

/// What the kinds derive their effects from.
class ModbusFault : public config::FaultEffect {
 public:
  /// What it does to the requests of the unit.
  virtual io::modbus::Interference interference() const = 0;
};

/// All kinds, for the section type of Modbus units.
const std::vector<config::FaultKind>& modbus_fault_kinds();

}  // namespace hil::buses::modbus
