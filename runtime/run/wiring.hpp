#pragma once
// Connects the parts of a scenario by their signals: who writes which, who reads which. Makes
// the scenery's meshes, so that files are read once and refused in time. Opens no device, so
// `hil check` can go this far; every mistake is reported with its place and the nearest name there is.
//
// Names of signals: "<module>.<output>", "can.<bus>.<Message>.<Signal>", "modbus.<unit>.<entry>". In
// addition, for every device, "can.<bus>.connected", "can.<bus>.<Message>.fresh", "modbus.<unit>.connected",
// "modbus.<unit>.<entry>.fresh" (1 or 0), except where a signal of the device has that name.

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
#include "runtime/run/scenery.hpp"

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
  /// Those of the scenario; when it lists none, those of the bodies that modules make, too.
  config::Layers layers;
  Scenery scenery;
  signals::SignalTable signals;
  std::vector<WiredModule> modules;
  std::vector<WiredCan> can;
  std::vector<WiredModbus> modbus;
};

/// The schemas of all module types, for config::load_scenario.
config::SchemaOfModules module_schemas();

/// What a module is told of its task.
modules::TaskFacts task_facts(const config::Scenario& scenario, const config::TaskSection& section);

/// Empty when there was any mistake.
std::optional<Wiring> wire(const config::Scenario& scenario, config::Diagnostics& diagnostics);

/// What the devices are made of, from their sections. The endpoint is the one to use; a section may leave it
/// open.
io::modbus::ClientSettings client_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);
io::modbus::ServerSettings server_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);

}  // namespace hil::run
