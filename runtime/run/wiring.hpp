#pragma once
// Connects the parts of a scenario by their signals: who writes which, who reads which. Opens nothing, so
// `hil check` can go this far; every mistake is reported with its place and the nearest name there is.
//
// Names of signals: "<module>.<output>", "can.<bus>.<Message>.<Signal>", "modbus.<unit>.<entry>".

#include <memory>
#include <optional>
#include <vector>

#include "io/can/can_device.hpp"
#include "io/modbus/client_device.hpp"
#include "io/modbus/server_device.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/modules/module.hpp"
#include "runtime/run/device_link.hpp"
#include "runtime/run/module_task.hpp"

namespace hil::run {

struct WiredModule {
  const config::TaskSection* section = nullptr;
  std::unique_ptr<modules::Module> module;
  ModuleTask::Links links;
};

struct WiredCan {
  const config::CanSection* section = nullptr;
  io::can::CanDeviceConfig device;
  DeviceLink::Links links;
};

struct WiredModbus {
  const config::ModbusSection* section = nullptr;
  DeviceLink::Links links;
};

/// The scenario outlives it.
struct Wiring {
  const config::Scenario* scenario = nullptr;
  signals::SignalTable signals;
  std::vector<WiredModule> modules;
  std::vector<WiredCan> can;
  std::vector<WiredModbus> modbus;
};

/// The schemas of all module types, for config::load_scenario.
config::SchemaOfModules module_schemas();

/// Empty when there was any mistake.
std::optional<Wiring> wire(const config::Scenario& scenario, config::Diagnostics& diagnostics);

/// What the devices are made of, from their sections. The endpoint is the one to use; a section may leave it
/// open.
io::modbus::ClientSettings client_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);
io::modbus::ServerSettings server_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);

}  // namespace hil::run
