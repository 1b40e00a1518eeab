#pragma once
// Connects the parts of a scenario by their signals, and makes the meshes of the scenery, so that mesh
// files are read once and mistakes in them are found early. Opens no device, so that `hil check` can use
// it. Every mistake has its place and the nearest known name. Each part of the scenario first declares the
// signals that it writes; then each resolves the names that it reads.
//
// Names of signals: "<module>.<output>", "<type of bus>.<bus>.<input>". For every bus also "<type of
// bus>.<bus>.connected" and "<type of bus>.<bus>.<group of inputs>.fresh" (1 or 0), and for groups whose
// frames are checked "<type of bus>.<bus>.<group of inputs>.rejected" (how many were rejected), unless a
// signal of the device has that name. A variable has its own name, without a dot. A stimulus has the name of
// what it drives, "<module>.<input>" or "<type of bus>.<bus>.<output>". For a fault there is
// "<signal>.faulted"; "stimulus.<name>" and "fault.<name>" are 1 while they are active. A relation of bodies
// that an expression reads has its own text, "distance(ego, rock)".

#include <memory>
#include <optional>
#include <vector>

#include <hil/module.hpp>

#include "runtime/buses/bus.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/injection/faults.hpp"
#include "runtime/injection/stimuli.hpp"
#include "runtime/run/bus_faults.hpp"
#include "runtime/run/module_task.hpp"
#include "runtime/run/run_variables.hpp"
#include "runtime/run/scenery.hpp"

namespace hil::run {

struct WiredModule {
  const config::TaskSection* section = nullptr;
  std::unique_ptr<modules::AnyModule> module;
  ModuleTask::Links links;
};

struct WiredBus {
  const config::BusSection* section = nullptr;
  std::unique_ptr<buses::BusWiring> bus;
  signals::Links links;
};

/// The scenario outlives it.
struct Wiring {
  const config::Scenario* scenario = nullptr;
  /// Those of the scenario; if it lists none, also those of the bodies that modules create.
  config::Layers layers;
  Scenery scenery;
  signals::SignalTable signals;
  RunVariables variables;
  injection::Stimuli stimuli;
  injection::Faults faults;
  std::vector<WiredModule> modules;
  std::vector<WiredBus> buses;  ///< in the order of the scenario
  std::vector<signals::SignalId> recorded;
  std::vector<BusFault> bus_faults;
};

/// All types of modules and buses, for config::load_scenario.
config::ScenarioTypes scenario_types();

/// The properties of a module's task.
modules::TaskParameters task_parameters(const config::Scenario& scenario, const config::TaskSection& section);

/// Adds a task to the scenario when its expressions read relations of bodies and none of its tasks computes
/// them. Empty when there is a mistake.
std::optional<Wiring> wire(config::Scenario& scenario, config::Diagnostics& diagnostics);

}  // namespace hil::run
