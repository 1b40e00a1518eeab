#pragma once
// The keys of a Modbus unit in a scenario, and those of a register map file.

#include <hil/schema.hpp>

namespace hil::buses::modbus {

/// Of one entry of the list `modbus`.
config::Schema modbus_schema();

/// Of a register map file.
config::Schema register_map_schema();

}  // namespace hil::buses::modbus
