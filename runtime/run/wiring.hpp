#pragma once
// Connects the parts of a scenario by their signals, and makes the meshes of the scenery, so that mesh
// files are read once and mistakes in them are found early. Opens no device, so that `hil check` can use
// it. Every mistake has its place and the nearest known name.
//
// Names of signals: "<module>.<output>", "can.<bus>.<Message>.<Signal>", "modbus.<unit>.<entry>". For every
// device also "can.<bus>.connected", "can.<bus>.<Message>.fresh", "modbus.<unit>.connected" and
// "modbus.<unit>.<entry>.fresh" (1 or 0), unless a signal of the device has that name.

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
  /// Those of the scenario; if it lists none, also those of the bodies that modules create.
  config::Layers layers;
  Scenery scenery;
  signals::SignalTable signals;
  std::vector<WiredModule> modules;
  std::vector<WiredCan> can;
  std::vector<WiredModbus> modbus;
};

/// The schemas of all module types, for config::load_scenario.
config::SchemaOfModules module_schemas();

/// The properties of a module's task.
modules::TaskFacts task_facts(const config::Scenario& scenario, const config::TaskSection& section);

/// Empty when there is a mistake.
std::optional<Wiring> wire(const config::Scenario& scenario, config::Diagnostics& diagnostics);

/// The settings of a unit, from its section and the endpoint that it uses: the section may leave the port
/// open.
io::modbus::ClientSettings client_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);
io::modbus::ServerSettings server_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint);

}  // namespace hil::run
