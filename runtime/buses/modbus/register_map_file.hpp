#pragma once
// The files that list a Modbus unit's registers.

#include <optional>
#include <string>

#include <hil/diagnostics.hpp>

#include "io/modbus/register_map.hpp"

namespace hil::buses::modbus {

/// Reads a register map file: {registers: [{name, table, address, type, ...}]}. Empty when there was any
/// mistake.
std::optional<io::modbus::RegisterMap> load_register_map(const std::string& path, io::modbus::Role role,
                                                         config::Diagnostics& diagnostics);

}  // namespace hil::buses::modbus
