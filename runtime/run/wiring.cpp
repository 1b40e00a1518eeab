#include "runtime/run/wiring.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <utility>

#include "io/can/socketcan_bus.hpp"
#include "runtime/run/can_wiring.hpp"
#include "runtime/run/world_wiring.hpp"

namespace hil::run {
namespace {

using config::Diagnostics;
using config::Place;
using config::Word;

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

/// The signals, and the prefixes of parts that could not be declared ("can.car."): a missing signal with
/// such a prefix is no further mistake.
struct Known {
  const signals::SignalTable& table;
  std::vector<std::string> undeclared;
  /// By signal index: why a double can not represent the signal exactly.
  std::map<std::uint32_t, std::string> imprecise = {};
  /// Received signals to which neither the scenario nor the DBC file gives a time-out, by index.
  std::set<std::uint32_t> never_stale = {};
};

signals::SignalId find_signal(const Known& known, const Word& word, Diagnostics& diagnostics) {
  if (const auto found = known.table.find(word.text)) {
    const auto imprecise = known.imprecise.find(found->index);
    if (imprecise != known.imprecise.end())
      diagnostics.warn(word.place, "'" + word.text + "' " + imprecise->second);
    return *found;
  }
  const auto& undeclared = known.undeclared;
  if (std::any_of(undeclared.begin(), undeclared.end(),
                  [&](const auto& p) { return word.text.starts_with(p); }))
    return {};
  diagnostics.add(word.place, "there is no signal '" + word.text + "'" +
                                  config::suggestion(word.text, known.table.names()));
  return {};
}

/// A signal and its reader (a channel of a device, an input of a module) need the same unit, since values
/// are not converted. Either may have none.
template <class Reader>
void check_unit(const signals::SignalTable& table, signals::SignalId signal, const Reader& reader,
                const Place& place, Diagnostics& diagnostics) {
  if (!signal.valid()) return;
  const auto spelled = [](std::string unit) {
    unit.erase(std::remove(unit.begin(), unit.end(), '^'), unit.end());
    return unit;
  };
  const std::string& unit = table.info(signal).unit;
  if (unit.empty() || reader.unit.empty() || spelled(unit) == spelled(reader.unit)) return;
  diagnostics.add(place, "'" + table.info(signal).name + "' is in " + unit + ", but '" + reader.name +
                             "' is in " + reader.unit);
}

void declare_modules(Wiring& wiring, std::vector<std::string>& undeclared, Diagnostics& diagnostics) {
  for (const config::TaskSection& section : wiring.scenario->tasks) {
    const modules::ModuleType* type = modules::find_module_type(section.type.text);
    WiredModule wired{
        .section = &section, .module = type->create(section.parameters, diagnostics), .links = {}};
    if (wired.module == nullptr) {
      undeclared.push_back(section.module.text + ".");
    } else {
      wired.module->check_task(section.parameters, task_facts(*wiring.scenario, section), diagnostics);
      for (const modules::Port& port : wired.module->ports().outputs) {
        add_signal(wiring.signals,
                   {.name = section.module.text + "." + port.name,
                    .unit = port.unit,
                    .writer = "module " + section.module.text,
                    .initial = port.initial},
                   section.module.place, diagnostics, wired.links.outputs);
      }
    }
    wiring.modules.push_back(std::move(wired));
  }
}

void connect_module(WiredModule& wired, const Known& known, Diagnostics& diagnostics) {
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
      const signals::SignalId signal = find_signal(known, link.signal, diagnostics);
      wired.links.inputs[static_cast<std::size_t>(port - ports.begin())] = signal;
      check_unit(known.table, signal, *port, link.signal.place, diagnostics);
    }
  }
  for (const modules::Port& port : ports) {
    const auto& inputs = wired.section->inputs;
    const bool connected =
        std::any_of(inputs.begin(), inputs.end(), [&](const auto& l) { return l.port.text == port.name; });
    if (port.required && !connected) {
      diagnostics.add(wired.section->module.place, "module " + wired.section->module.text +
                                                       " needs its input '" + port.name + "' (" + port.about +
                                                       ")");
    }
  }
}

void declare_inputs(const io::Device& device, const std::string& prefix, const Place& place, Wiring& wiring,
                    DeviceLink::Links& links, Diagnostics& diagnostics) {
  const std::string writer = prefix.substr(0, prefix.size() - 1);
  std::vector<std::int64_t> timeouts_ns(device.inputs().size(), 0);
  for (const io::InputGroup& group : device.input_groups())
    std::fill_n(timeouts_ns.begin() + static_cast<std::ptrdiff_t>(group.first), group.count,
                group.timeout_ns);
  for (std::size_t i = 0; i < device.inputs().size(); ++i) {
    const io::ChannelInfo& channel = device.inputs()[i];
    add_signal(wiring.signals,
               {.name = prefix + channel.name,
                .unit = channel.unit,
                .writer = writer,
                .initial = channel.safe_value,
                .arrives = true,
                .timeout_ns = timeouts_ns[i]},
               place, diagnostics, links.inputs);
  }
  const auto add_state = [&](const std::string& name) -> signals::SignalId {
    if (!wiring.signals.find(prefix + name)) return wiring.signals.add({prefix + name, "", writer});
    diagnostics.warn(place, "'" + prefix + name +
                                "' is a signal of the device itself, so there is no such signal of the "
                                "device's state; give the device's signal another name");
    return {};
  };
  links.connected = add_state("connected");
  for (const io::InputGroup& group : device.input_groups())
    links.fresh.push_back(add_state(group.name + ".fresh"));
}

/// Gives every output its safe value as a constant; connected outputs replace it.
void set_safe_values(const io::Device& device, DeviceLink::Links& links) {
  for (const io::ChannelInfo& channel : device.outputs())
    links.outputs.push_back({.signal = {}, .constant = channel.safe_value});
}

std::size_t output_index(const io::Device& device, const std::string& channel) {
  const auto outputs = device.outputs();
  return static_cast<std::size_t>(
      std::find_if(outputs.begin(), outputs.end(), [&](const auto& info) { return info.name == channel; }) -
      outputs.begin());
}

struct CanProbe {
  std::unique_ptr<io::can::CanDevice> device;  // never opened; has the channels
  WiredCan wired;

  /// Null for a message that could not be configured.
  const io::can::DbcMessage* sent(const config::SentMessage& message) const {
    return used(message.message, wired.device.send);
  }
  const io::can::DbcMessage* received(const config::ReceivedMessage& message) const {
    return used(message.message, wired.device.receive);
  }

 private:
  template <class Configured>
  const io::can::DbcMessage* used(const Word& name, const std::vector<Configured>& configured) const {
    const io::can::DbcMessage* const message = wired.device.database.find_message(name.text);
    const bool is_used = message != nullptr && std::ranges::find(configured, message->name,
                                                                 &Configured::message) != configured.end();
    return is_used ? message : nullptr;
  }
};

/// Adds the short names, value names, precision and lack of a time-out of the bus's signals.
void describe_can_signals(const CanProbe& probe, Wiring& wiring, Known& known) {
  const std::string prefix = "can." + probe.wired.section->bus.text + ".";
  const auto describe = [&](const Word& name, const io::can::DbcMessage* used) {
    if (used == nullptr) {
      // The name of the message is a mistake here; a signal of the bus elsewhere may be right.
      const bool is_known = probe.wired.device.database.find_message(name.text) != nullptr;
      return known.undeclared.push_back(is_known ? prefix + name.text + "." : prefix);
    }
    const io::can::DbcMessage& message = *used;
    for (const io::can::DbcSignal& signal : message.signals) {
      const auto id = wiring.signals.find(prefix + message.name + "." + signal.name);
      if (!id) continue;
      for (const std::string& first : {message.name, message.short_name}) {
        for (const std::string& second : {signal.name, signal.short_name}) {
          std::string alias = prefix;
          alias.append(first).append(".").append(second);
          wiring.signals.add_alias(alias, *id);
        }
      }
      wiring.signals.set_named_values(*id, named_values_of(signal));
      const std::string warning = precision_warning(signal);
      if (!warning.empty()) known.imprecise.emplace(id->index, warning);
    }
  };
  for (const config::SentMessage& sent : probe.wired.section->send)
    describe(sent.message, probe.sent(sent));
  for (const config::ReceivedMessage& received : probe.wired.section->receive) {
    const io::can::DbcMessage* const message = probe.received(received);
    describe(received.message, message);
    if (message == nullptr || received.timeout_ns) continue;
    for (const io::can::DbcSignal& signal : message->signals) {
      const auto id = wiring.signals.find(prefix + message->name + "." + signal.name);
      if (id && wiring.signals.info(*id).timeout_ns == 0) known.never_stale.insert(id->index);
    }
  }
}

std::vector<CanProbe> declare_can(Wiring& wiring, Known& known, Diagnostics& diagnostics) {
  std::vector<CanProbe> probes;
  for (const config::CanSection& section : wiring.scenario->can) {
    auto config = describe_can_device(*wiring.scenario, section, diagnostics);
    if (!config) {
      known.undeclared.push_back("can." + section.bus.text + ".");
      continue;
    }
    CanProbe probe{.device = std::make_unique<io::can::CanDevice>(
                       *config, std::make_unique<io::can::SocketCanBus>(
                                    io::can::SocketCanConfig{.interface = section.bus.text})),
                   .wired = {.section = &section, .device = std::move(*config), .links = {}}};
    declare_inputs(*probe.device, "can." + section.bus.text + ".", section.bus.place, wiring,
                   probe.wired.links, diagnostics);
    set_safe_values(*probe.device, probe.wired.links);
    describe_can_signals(probe, wiring, known);
    probes.push_back(std::move(probe));
  }
  return probes;
}

/// Connects an output to a value name of its DBC signal or to a signal of the run, whose name has a dot.
void connect_can_output(const Word& word, const io::can::DbcSignal& signal, const io::ChannelInfo& channel,
                        DeviceLink::Source& target, const Known& known, Diagnostics& diagnostics) {
  const std::map<std::string, double> values = named_values_of(signal);
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.";
  const bool may_be_signal =
      word.text.find('.') != std::string::npos && word.text.find_first_not_of(letters) == std::string::npos;
  if (!may_be_signal || (values.contains(word.text) && !known.table.find(word.text))) {
    if (const auto value = value_named(values, word, channel.name, diagnostics)) target.constant = *value;
    return;
  }
  target.signal = find_signal(known, word, diagnostics);
  check_unit(known.table, target.signal, channel, word.place, diagnostics);
}

void connect_can(CanProbe& probe, const Known& known, Diagnostics& diagnostics) {
  for (const config::SentMessage& sent : probe.wired.section->send) {
    const io::can::DbcMessage* const used = probe.sent(sent);
    if (used == nullptr) continue;
    const io::can::DbcMessage& message = *used;
    for (const io::can::DbcSignal& signal : message.signals) {
      const std::size_t index = output_index(*probe.device, message.name + "." + signal.name);
      const auto start = start_value_of(signal);
      if (index < probe.wired.links.outputs.size() && start)
        probe.wired.links.outputs[index].constant = *start;
    }
    warn_of_unset_signals(sent, message, diagnostics);
    for (const config::SignalSource& source : sent.signals) {
      const io::can::DbcSignal* const found = message.find_signal(source.dbc_signal.text);
      if (found == nullptr) continue;
      const io::can::DbcSignal& signal = *found;
      const std::size_t index = output_index(*probe.device, message.name + "." + signal.name);
      if (index == probe.wired.links.outputs.size()) {
        diagnostics.add(source.dbc_signal.place,
                        "'" + source.dbc_signal.text + "' of " + sent.message.text +
                            " is its counter or checksum, which the bus fills at the send instant");
        continue;
      }
      const std::string imprecise = precision_warning(signal);
      if (!imprecise.empty())
        diagnostics.warn(source.dbc_signal.place, "'" + source.dbc_signal.text + "' " + imprecise);
      DeviceLink::Source& target = probe.wired.links.outputs[index];
      if (const double* constant = std::get_if<double>(&source.source)) {
        target.constant = *constant;
      } else {
        connect_can_output(std::get<Word>(source.source), signal, probe.device->outputs()[index], target,
                           known, diagnostics);
      }
    }
  }
}

std::unique_ptr<io::Device> modbus_probe(const config::ModbusSection& section) {
  if (section.role == io::modbus::Role::client) {
    return std::make_unique<io::modbus::ClientDevice>(client_settings(section, {}), section.registers);
  }
  return std::make_unique<io::modbus::ServerDevice>(server_settings(section, {}), section.registers);
}

void connect_modbus(const io::Device& device, WiredModbus& wired, const Known& known,
                    Diagnostics& diagnostics) {
  for (const config::RegisterWrite& write : wired.section->write) {
    const std::size_t index = output_index(device, write.entry.text);
    if (index == wired.links.outputs.size()) {
      diagnostics.add(write.entry.place, "'" + write.entry.text + "' is filled by the device itself");
      continue;
    }
    DeviceLink::Source& target = wired.links.outputs[index];
    if (const double* constant = std::get_if<double>(&write.source)) {
      target.constant = *constant;
    } else {
      const Word& word = std::get<Word>(write.source);
      target.signal = find_signal(known, word, diagnostics);
      check_unit(known.table, target.signal, device.outputs()[index], word.place, diagnostics);
    }
  }
}

void check_expectations(const config::Scenario& scenario, const Known& known, Diagnostics& diagnostics) {
  const auto check = [&](const config::Condition& condition) {
    for (const Word& mention : condition.mentions())
      find_signal(known, mention, diagnostics);
    for (const config::Condition::NamedValue& value : condition.named_values()) {
      const std::string& signal = condition.mentions()[value.mention].text;
      if (const auto id = known.table.find(signal))
        value_named(known.table.info(*id).named_values, value.name, signal, diagnostics);
    }
  };
  const auto check_every_tick = [&](const config::Condition& condition) {
    check(condition);
    for (const Word& mention : condition.mentions()) {
      const auto id = known.table.find(mention.text);
      if (!id || !known.never_stale.contains(id->index)) continue;
      diagnostics.warn(mention.place,
                       "'" + mention.text +
                           "' has no time-out, so the expectation counts as checked after its sender has "
                           "stopped; give its message a 'timeout' ('0 ms' if that is meant)");
    }
  };
  for (const config::Expectation& expectation : scenario.expectations) {
    if (const auto* never = std::get_if<config::Never>(&expectation.claim))
      check_every_tick(never->condition);
    if (const auto* always = std::get_if<config::Always>(&expectation.claim))
      check_every_tick(always->condition);
    if (const auto* eventually = std::get_if<config::Eventually>(&expectation.claim))
      check(eventually->condition);
    if (const auto* response = std::get_if<config::Response>(&expectation.claim)) {
      find_signal(known, response->request, diagnostics);
      find_signal(known, response->reply, diagnostics);
    }
  }
}

}  // namespace

modules::TaskFacts task_facts(const config::Scenario& scenario, const config::TaskSection& section) {
  const std::int64_t period_ns = scenario.base_period_ns * section.every_ticks;
  return {.instance = section.module.text,
          .period_ns = period_ns,
          .offset_ns = scenario.base_period_ns * section.offset_ticks,
          .deadline_ns = section.deadline_ns == 0 ? period_ns : section.deadline_ns,
          .seed = scenario.seed,
          .own_thread = !section.thread.empty()};
}

config::SchemaOfModules module_schemas() {
  config::SchemaOfModules schemas;
  for (const modules::ModuleType& type : modules::module_types())
    schemas.emplace(type.name, type.parameters);
  return schemas;
}

io::modbus::ClientSettings client_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint) {
  using std::chrono::ceil;
  using std::chrono::microseconds;
  using std::chrono::milliseconds;
  using std::chrono::nanoseconds;
  io::modbus::ClientSettings settings;
  settings.name = section.unit.text;
  settings.endpoint = endpoint;
  settings.unit = section.unit_id;
  settings.max_gap = section.max_gap;
  settings.response_timeout = ceil<microseconds>(nanoseconds(section.timeout_ns));
  settings.start_limit = ceil<milliseconds>(nanoseconds(section.start_limit_ns));
  if (section.max_age_ns) settings.max_age = ceil<milliseconds>(nanoseconds(*section.max_age_ns));
  if (section.run_time_entry) settings.run_time_ms_entry = section.run_time_entry->text;
  if (section.heartbeat_entry) settings.heartbeat_entry = section.heartbeat_entry->text;
  return settings;
}

io::modbus::ServerSettings server_settings(const config::ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint) {
  io::modbus::ServerSettings settings;
  settings.name = section.unit.text;
  settings.endpoint = endpoint;
  settings.limits.max_connections = section.max_clients;
  if (section.max_age_ns) {
    settings.max_age =
        std::chrono::ceil<std::chrono::milliseconds>(std::chrono::nanoseconds(*section.max_age_ns));
  }
  return settings;
}

std::optional<Wiring> wire(const config::Scenario& scenario, config::Diagnostics& diagnostics) {
  Wiring wiring;
  wiring.scenario = &scenario;
  const std::size_t before = diagnostics.count();
  Known known{.table = wiring.signals, .undeclared = {}};
  declare_modules(wiring, known.undeclared, diagnostics);
  std::vector<CanProbe> can = declare_can(wiring, known, diagnostics);
  std::vector<std::unique_ptr<io::Device>> modbus;
  for (const config::ModbusSection& section : scenario.modbus) {
    modbus.push_back(modbus_probe(section));
    WiredModbus& wired = wiring.modbus.emplace_back(WiredModbus{.section = &section, .links = {}});
    declare_inputs(*modbus.back(), "modbus." + section.unit.text + ".", section.unit.place, wiring,
                   wired.links, diagnostics);
    set_safe_values(*modbus.back(), wired.links);
  }

  for (WiredModule& wired : wiring.modules)
    connect_module(wired, known, diagnostics);
  for (CanProbe& probe : can) {
    connect_can(probe, known, diagnostics);
    wiring.can.push_back(std::move(probe.wired));
  }
  for (std::size_t i = 0; i < modbus.size(); ++i)
    connect_modbus(*modbus[i], wiring.modbus[i], known, diagnostics);
  wire_world(wiring, diagnostics);
  check_expectations(scenario, known, diagnostics);
  if (diagnostics.count() != before) return std::nullopt;
  return wiring;
}

}  // namespace hil::run
