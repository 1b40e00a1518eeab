#pragma once
// The settings of a Modbus unit's device, from the unit's section of a scenario.

#include "io/modbus/client_device.hpp"
#include "io/modbus/server_device.hpp"
#include "runtime/buses/modbus/modbus_section.hpp"

namespace hil::buses::modbus {

/// `endpoint`: the one that the unit uses; the section may leave the port open.
io::modbus::ClientSettings client_settings(const ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);
io::modbus::ServerSettings server_settings(const ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);

}  // namespace hil::buses::modbus
