#include "runtime/run/wiring.hpp"

#include <algorithm>
#include <array>
#include <new>
#include <utility>

#include "runtime/expectations/kinds.hpp"
#include "runtime/injection/waveform.hpp"
#include "runtime/modules/registry.hpp"
#include "runtime/plugins/plugins.hpp"
#include "runtime/recording/signal_selection.hpp"
#include "runtime/run/fault_kinds.hpp"
#include "runtime/run/relation_wiring.hpp"
#include "runtime/run/step_guard.hpp"
#include "runtime/run/world_wiring.hpp"

namespace hil::run {
namespace {

using config::Diagnostics;
using config::Place;
using config::Word;
using signals::KnownSignals;

void add_signal(signals::SignalTable& table, signals::SignalInfo info, const Place& place,
                Diagnostics& diagnostics, std::vector<signals::SignalId>& ids) {
  if (const auto there = table.find(info.name)) {
    diagnostics.add(place, "two writers of one signal: '" + info.name + "' is written by " +
                               table.info(*there).writer + " and by " + info.writer);
    ids.push_back(*there);
    return;
  }
  ids.push_back(table.add(std::move(info)));
}

/// The signals that buses receive, and those that they send, which stimuli may drive, with their value names.
/// Modules need the names when they are made, but in the table of the run (and so in signals.csv) the signals
/// of modules come first.
struct BusSignals {
  signals::SignalTable table;
  KnownSignals known{table};
};

/// The wiring while its parts declare and resolve names.
struct WiringState {
  config::Scenario& scenario;
  Wiring& wiring;
  Diagnostics& diagnostics;
  signals::RelationSignals relations{
      .writer = "module " + relations_module(scenario), .relations = {}, .signals = {}};
  KnownSignals known{wiring.signals, &relations};
};

/// The value names of the signals that the module's inputs read.
std::map<std::string, modules::ValueNames> value_names(const config::TaskSection& section,
                                                       const BusSignals& of_buses,
                                                       const KnownSignals& known) {
  std::map<std::string, modules::ValueNames> names;
  for (const config::InputLink& link : section.inputs) {
    const std::string& signal = link.signal.text;
    for (const KnownSignals* signals : {&of_buses.known, &known}) {
      if (const auto id = signals->table().find(signal)) {
        const signals::SignalInfo& info = signals->table().info(*id);
        if (!info.named_values.empty()) names[link.port.text] = {info.named_values, info.unit};
      } else if (signals->is_undeclared(signal)) {
        names[link.port.text] = {.accepts_any_name = true};
      }
    }
  }
  return names;
}

void declare_inputs(const WiredBus& bus, KnownSignals& known, signals::Links& links,
                    Diagnostics& diagnostics) {
  const io::Device& device = bus.bus->channels();
  const std::string prefix = bus.section->full_name() + ".";
  const Place& place = bus.section->name.place;
  signals::SignalTable& table = known.table();
  const std::string writer = prefix.substr(0, prefix.size() - 1);
  std::vector<std::int64_t> timeouts_ns(device.inputs().size(), 0);
  for (const io::InputGroup& group : device.input_groups())
    std::fill_n(timeouts_ns.begin() + static_cast<std::ptrdiff_t>(group.first), group.count,
                group.timeout_ns);
  for (std::size_t i = 0; i < device.inputs().size(); ++i) {
    const io::ChannelInfo& channel = device.inputs()[i];
    add_signal(table,
               {.name = prefix + channel.name,
                .unit = channel.unit,
                .writer = writer,
                .initial = channel.safe_value,
                .arrives = true,
                .timeout_ns = timeouts_ns[i]},
               place, diagnostics, links.inputs);
  }
  const auto add_state = [&](const std::string& name) -> signals::SignalId {
    if (!table.find(prefix + name)) return table.add({prefix + name, "", writer});
    diagnostics.warn(place, "'" + prefix + name +
                                "' is a signal of the device itself, so there is no such signal of the "
                                "device's state; give the device's signal another name");
    return {};
  };
  links.connected = add_state("connected");
  for (const io::InputGroup& group : device.input_groups())
    links.fresh.push_back(add_state(group.name + ".fresh"));
  for (const io::InputGroup& group : device.input_groups())
    links.rejected.push_back(group.can_reject ? add_state(group.name + ".rejected") : signals::SignalId{});
  bus.bus->describe_signals(prefix, known);
}

void declare_bus_signals(const Wiring& wiring, BusSignals& signals) {
  Diagnostics ignored;  // declare_buses reports the same mistakes
  for (const WiredBus& wired : wiring.buses) {
    signals::Links unused;
    declare_inputs(wired, signals.known, unused, ignored);
    const std::string prefix = wired.section->full_name() + ".";
    for (const io::ChannelInfo& output : wired.bus->channels().outputs()) {
      if (!signals.table.find(prefix + output.name))
        signals.table.add(
            {.name = prefix + output.name, .unit = output.unit, .writer = wired.section->full_name()});
    }
    wired.bus->describe_signals(prefix, signals.known);
  }
}

/// Adds a mistake if transactions of the module can not be firm. `module`: null where it is not made yet.
void check_firm(const config::TaskSection& section, const modules::ModuleType& type,
                modules::AnyModule* module, Diagnostics& diagnostics) {
  const bool has_world = module == nullptr || module->world_module() != nullptr;
  if (has_world && !type.writes) return;
  diagnostics.add(*section.firm_at, "'transactions: firm' is for tasks that only read the world; module " +
                                        section.module.text + " of type " + type.name +
                                        (type.writes ? " writes to it" : " does not use it") +
                                        ", so leave the key out");
}

void declare_modules(WiringState& state) {
  auto& [scenario, wiring, diagnostics, relations, known] = state;
  BusSignals of_buses;
  declare_bus_signals(wiring, of_buses);
  for (const config::TaskSection& section : scenario.tasks) {
    const modules::ModuleType* type = modules::find_module_type(section.type.text);
    modules::TaskParameters task = task_parameters(scenario, section);
    task.value_names = value_names(section, of_buses, known);
    WiredModule wired{.section = &section, .module = nullptr, .links = {}};
    if (!type->computes.empty()) {  // wire_relations makes it, when the relations are known
      wiring.modules.push_back(std::move(wired));
      continue;
    }
    try {
      wired.module = type->create(section.parameters, task, diagnostics);
    } catch (const std::bad_alloc&) {
      throw;
    } catch (...) {
      diagnostics.add(section.module.place, name_with_plugin(section.module.text, type->name) +
                                                " can not be made: " + text_of_exception());
    }
    if (section.firm_at) check_firm(section, *type, wired.module.get(), diagnostics);
    if (wired.module == nullptr) {
      known.add_undeclared(section.module.text + ".");
    } else {
      for (const modules::Port& port : wired.module->ports().outputs) {
        add_signal(wiring.signals,
                   {.name = section.module.text + "." + port.name,
                    .unit = port.unit,
                    .writer = "module " + section.module.text,
                    .initial = port.initial,
                    .named_values = port.named_values,
                    .value_kind = port.value_kind},
                   section.module.place, diagnostics, wired.links.outputs);
      }
    }
    wiring.modules.push_back(std::move(wired));
  }
}

/// Whether a stimulus drives the input.
bool is_driven(const config::Scenario& scenario, const std::string& input) {
  return std::ranges::any_of(scenario.stimuli,
                             [&](const auto& stimulus) { return stimulus.drives.text == input; });
}

void connect_module(WiredModule& wired, const config::Scenario& scenario, const KnownSignals& known,
                    Diagnostics& diagnostics) {
  if (wired.module == nullptr) return;
  const std::vector<modules::Port>& ports = wired.module->ports().inputs;
  wired.links.inputs.resize(ports.size());
  for (const config::InputLink& link : wired.section->inputs) {
    const auto port =
        std::find_if(ports.begin(), ports.end(), [&](const auto& p) { return p.name == link.port.text; });
    if (port == ports.end()) {
      std::vector<std::string> names;
      names.reserve(ports.size());
      for (const modules::Port& other : ports)
        names.push_back(other.name);
      diagnostics.add(link.port.place, "module " + wired.section->module.text + " has no input '" +
                                           link.port.text + "'" + config::suggestion(link.port.text, names));
    } else {
      const signals::SignalId signal = known.find(link.signal, diagnostics);
      wired.links.inputs[static_cast<std::size_t>(port - ports.begin())] = {
          .signal = signal,
          .conversion = known.conversion_for(signal, port->name, port->unit, link.signal.place, diagnostics)};
    }
  }
  for (const modules::Port& port : ports) {
    const auto& inputs = wired.section->inputs;
    const bool connected =
        std::any_of(inputs.begin(), inputs.end(), [&](const auto& l) { return l.port.text == port.name; });
    if (port.required && !connected && !is_driven(scenario, wired.section->module.text + "." + port.name)) {
      diagnostics.add(wired.section->module.place, "module " + wired.section->module.text +
                                                       " needs its input '" + port.name + "' (" + port.about +
                                                       ")");
    }
  }
}

void resolve_modules(WiringState& state) {
  for (WiredModule& wired : state.wiring.modules)
    connect_module(wired, state.scenario, state.known, state.diagnostics);
}

/// Of an output: from one value that leaves the run to the next.
std::int64_t send_period_ns(const WiredBus& wired, std::size_t output) {
  return std::max(wired.section->period_ns, wired.bus->channels().send_cycle(output).period_ns);
}

/// What stimuli may drive. `signal` is null before the modules and buses are connected.
std::vector<injection::Target> targets_of(Wiring& wiring) {
  std::vector<injection::Target> targets;
  for (WiredModule& wired : wiring.modules) {
    if (wired.module == nullptr) continue;
    const std::vector<modules::Port>& ports = wired.module->ports().inputs;
    auto& inputs = wired.links.inputs;
    for (std::size_t i = 0; i < ports.size(); ++i)
      targets.push_back({.name = wired.section->module.text + "." + ports[i].name,
                         .unit = ports[i].unit,
                         .initial = ports[i].initial,
                         .period_ns = wiring.scenario->base_period_ns * wired.section->every_ticks,
                         .signal = i < inputs.size() ? &inputs[i].signal : nullptr});
  }
  for (WiredBus& wired : wiring.buses) {
    const auto channels = wired.bus->channels().outputs();
    for (std::size_t i = 0; i < channels.size(); ++i)
      targets.push_back({.name = wired.section->full_name() + "." + channels[i].name,
                         .unit = channels[i].unit,
                         .initial = channels[i].safe_value,
                         .period_ns = send_period_ns(wired, i),
                         .signal = &wired.links.outputs[i].signal});
  }
  return targets;
}

/// The readers of signals that faults can redirect.
std::vector<injection::Reader> readers_of(Wiring& wiring) {
  std::vector<injection::Reader> readers;
  for (WiredModule& wired : wiring.modules) {
    for (std::size_t i = 0; i < wired.links.inputs.size(); ++i)
      readers.push_back({.owner = wired.section->module.text,
                         .name = wired.section->module.text + "." + wired.module->ports().inputs[i].name,
                         .period_ns = wiring.scenario->base_period_ns * wired.section->every_ticks,
                         .signal = &wired.links.inputs[i].signal});
  }
  for (WiredBus& wired : wiring.buses) {
    const auto channels = wired.bus->channels().outputs();
    for (std::size_t i = 0; i < channels.size(); ++i)
      readers.push_back({.owner = wired.section->full_name(),
                         .name = wired.section->full_name() + "." + channels[i].name,
                         .period_ns = send_period_ns(wired, i),
                         .signal = &wired.links.outputs[i].signal});
  }
  return readers;
}

/// A bus of which nothing can be used has a mistake and is left out.
void make_buses(WiringState& state) {
  auto& [scenario, wiring, diagnostics, relations, known] = state;
  for (const std::shared_ptr<const config::BusSection>& section : scenario.buses) {
    std::unique_ptr<buses::BusWiring> bus = buses::type_of(*section).wire(*section, diagnostics);
    if (bus == nullptr)
      known.add_undeclared(section->full_name() + ".");
    else
      wiring.buses.push_back(WiredBus{.section = section.get(), .bus = std::move(bus), .links = {}});
  }
}

void declare_buses(WiringState& state) {
  for (WiredBus& wired : state.wiring.buses) {
    declare_inputs(wired, state.known, wired.links, state.diagnostics);
    for (const io::ChannelInfo& channel : wired.bus->channels().outputs())
      wired.links.outputs.push_back({.signal = {}, .constant = channel.safe_value});
  }
}

void resolve_buses(WiringState& state) {
  for (WiredBus& wired : state.wiring.buses)
    wired.bus->connect(state.known, wired.links.outputs, state.diagnostics);
}

void declare_stimuli(WiringState& state) {
  auto& [scenario, wiring, diagnostics, relations, known] = state;
  wiring.stimuli.declare(scenario, known, targets_of(wiring), diagnostics);
  for (const WiredBus& wired : wiring.buses)  // outputs that stimuli drive
    wired.bus->describe_signals(wired.section->full_name() + ".", known);
}

void resolve_stimuli(WiringState& state) {
  auto& [scenario, wiring, diagnostics, relations, known] = state;
  wiring.stimuli.connect(targets_of(wiring), wiring.signals, diagnostics);
  wiring.stimuli.compile(scenario, known, diagnostics);
}

std::vector<FaultyBus> faulty_buses(const Wiring& wiring) {
  std::vector<FaultyBus> buses;
  for (const WiredBus& wired : wiring.buses)
    buses.push_back({.full_name = wired.section->full_name(), .wiring = wired.bus.get()});
  return buses;
}

void declare_faults(WiringState& state) {
  state.wiring.faults.declare(state.scenario, state.known, state.diagnostics);
}

void resolve_faults(WiringState& state) {
  auto& [scenario, wiring, diagnostics, relations, known] = state;
  wiring.faults.redirect(readers_of(wiring), diagnostics);
  wiring.faults.compile(scenario, known, diagnostics);
  wiring.bus_faults = bus_faults(scenario, faulty_buses(wiring), diagnostics);
  check_fault_targets(scenario, diagnostics);
}

/// The unit of a variable is that of its expression, whose names are resolved here. So variables are declared
/// last.
void declare_variables(WiringState& state) {
  state.wiring.variables.declare(state.scenario, state.known, state.diagnostics);
}

/// What an expectation reads is known where all its names are: it has no mistake, and neither has a part
/// whose signals it may name. A fault of a signal that nobody reads is a mistake.
void resolve_expectations(WiringState& state) {
  auto& [scenario, wiring, diagnostics, relations, known] = state;
  const expectations::ClaimCheck check{.known = known,
                                       .period_ns = scenario.base_period_ns,
                                       .duration_ns = scenario.duration_ns,
                                       .diagnostics = diagnostics,
                                       .variables = scenario.variables};
  for (const config::VariableSection& variable : scenario.variables)
    if (variable.expression && known.table().find(variable.name.text)) check.times(*variable.expression);
  for (const config::Expectation& expectation : scenario.expectations) {
    const std::size_t before = diagnostics.count();
    expectations::check_expectation(expectation, check);
    if (diagnostics.count() != before || known.has_undeclared()) continue;
    wiring.faults.add_reading_expectation(
        expectation.name, expectations::signals_read(expectation, wiring.signals), wiring.signals);
  }
  if (!known.has_undeclared()) wiring.faults.check_readers(diagnostics);
}

void resolve_plots(WiringState& state) {
  for (const config::PlotSection& plot : state.scenario.plots) {
    for (const Word& signal : plot.signals)
      state.known.find(signal, state.diagnostics);
  }
}

void resolve_recording(WiringState& state) {
  const auto& recording = state.scenario.recording;
  if (recording)
    state.wiring.recorded = recording::selected_signals(*recording, state.known, state.diagnostics);
}

/// After all expressions, which name the relations.
void resolve_relations(WiringState& state) {
  wire_relations(state.scenario, state.relations, state.wiring, state.diagnostics);
}

/// After the modules, that of the relations included.
void resolve_world(WiringState& state) {
  wire_world(state.wiring, state.diagnostics);
}

/// A part of a scenario. First each part declares the signals that it writes, then each resolves the names
/// that it reads, so that a name may be that of any signal.
struct Part {
  void (*declare)(WiringState& state);  ///< null: it writes none
  void (*resolve)(WiringState& state);  ///< null: it reads none
};
/// In the order of their signals and mistakes.
constexpr std::array parts{
    Part{.declare = declare_modules, .resolve = resolve_modules},
    Part{.declare = declare_buses, .resolve = resolve_buses},
    Part{.declare = declare_stimuli, .resolve = resolve_stimuli},
    Part{.declare = declare_faults, .resolve = resolve_faults},
    Part{.declare = declare_variables, .resolve = nullptr},
    Part{.declare = nullptr, .resolve = resolve_expectations},
    Part{.declare = nullptr, .resolve = resolve_plots},
    Part{.declare = nullptr, .resolve = resolve_recording},
    Part{.declare = nullptr, .resolve = resolve_relations},
    Part{.declare = nullptr, .resolve = resolve_world},
};

std::optional<config::PluginTypes> load_plugin(const std::string& entry, const std::filesystem::path& folder,
                                               std::string& fault) {
  const auto path = plugins::find_plugin(entry, folder, fault);
  if (!path) return std::nullopt;
  const auto loaded = plugins::load_plugin(*path, fault);
  if (!loaded) return std::nullopt;
  config::PluginTypes types{.plugin = loaded->identity, .modules = {}};
  for (const std::string& type : loaded->types)
    types.modules.emplace(type, modules::find_module_type(type)->parameters);
  return types;
}

}  // namespace

modules::TaskParameters task_parameters(const config::Scenario& scenario,
                                        const config::TaskSection& section) {
  const std::int64_t period_ns = scenario.base_period_ns * section.every_ticks;
  return {.instance = section.module.text,
          .period_ns = period_ns,
          .tick_ns = scenario.base_period_ns,
          .offset_ns = scenario.base_period_ns * section.offset_ticks,
          .deadline_ns = section.deadline_ns == 0 ? period_ns : section.deadline_ns,
          .seed = scenario.seed,
          .own_thread = !section.thread.empty(),
          .firm = section.firm_at.has_value()};
}

config::ScenarioTypes scenario_types() {
  config::ScenarioTypes types{.modules = {},
                              .load_plugin = load_plugin,
                              .buses = buses::section_types(),
                              .waveforms = injection::waveforms(),
                              .faults = fault_kinds(),
                              .expectations = expectations::kinds(),
                              .table_claims = expectations::table_claims()};
  for (const modules::ModuleType& type : modules::module_types())
    if (plugins::plugin_of(type.name).empty()) types.modules.emplace(type.name, type.parameters);
  return types;
}

std::optional<Wiring> wire(config::Scenario& scenario, config::Diagnostics& diagnostics) {
  // WiredModule::section is the address of a task, and wire_relations may add a task.
  scenario.tasks.reserve(scenario.tasks.size() + 1);
  Wiring wiring;
  wiring.scenario = &scenario;
  const std::size_t before = diagnostics.count();
  WiringState state{.scenario = scenario, .wiring = wiring, .diagnostics = diagnostics};
  make_buses(state);
  for (const Part& part : parts)
    if (part.declare != nullptr) part.declare(state);
  for (const Part& part : parts)
    if (part.resolve != nullptr) part.resolve(state);
  if (diagnostics.count() != before) return std::nullopt;
  return wiring;
}

}  // namespace hil::run
