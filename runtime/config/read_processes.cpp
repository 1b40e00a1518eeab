#include "runtime/config/scenario_parts.hpp"

namespace hil::config {
namespace {

constexpr const char* dut_name = "dut";

/// One {section.NAME} of a command word that begins at `begin`; empty with a mistake.
std::optional<CommandWord::Placeholder> read_placeholder(const Value& word, std::size_t begin,
                                                         const Reading& reading) {
  const std::string& text = word.text();
  const auto refuse = [&](const std::string& message) {
    reading.diagnostics.add(word.place_in_text(begin), message);
    return std::nullopt;
  };
  const std::size_t end = text.find('}', begin);
  if (end == std::string::npos)
    return refuse("this '{' has no '}'; a placeholder is {can.BUS}, {modbus.UNIT} or {clock}");
  const std::string inside = text.substr(begin + 1, end - begin - 1);
  if (inside == "clock") return CommandWord::Placeholder{begin, end + 1 - begin, "clock", ""};
  const std::size_t dot = inside.find('.');
  const std::string section = inside.substr(0, dot);
  const std::string name = dot == std::string::npos ? "" : inside.substr(dot + 1);
  if ((section != "can" && section != "modbus") || name.empty()) {
    return refuse(in_quotes("{" + inside + "}") +
                  " is no placeholder; those are {can.BUS}, {modbus.UNIT} and {clock}");
  }
  const std::vector<std::string>& known = section == "can" ? reading.can_buses : reading.modbus_units;
  for (const std::string& candidate : known) {
    if (candidate == name) return CommandWord::Placeholder{begin, end + 1 - begin, section, name};
  }
  return refuse("there is no " + std::string(section == "can" ? "CAN bus " : "Modbus unit ") +
                in_quotes(name) + (known.empty() ? " (nor any other)" : suggestion(name, known)));
}

CommandWord read_word(const Value& value, const Reading& reading) {
  CommandWord word{word_of(value), {}};
  const std::string& text = value.text();
  for (std::size_t at = text.find('{'); at != std::string::npos; at = text.find('{', at + 1)) {
    std::optional<CommandWord::Placeholder> placeholder = read_placeholder(value, at, reading);
    if (!placeholder) break;
    word.placeholders.push_back(std::move(*placeholder));
  }
  return word;
}

void read_process(const Word& name, const Value& value, Scenario& scenario, const Reading& reading) {
  ProcessSection process;
  process.name = name;
  if (const Value* const command = part_of(value, "command")) {
    for (const Value& word : command->items())
      process.command.push_back(read_word(word, reading));
  }
  if (!is_whole(value)) return;
  process.enabled = value["enabled"].boolean();
  process.safe_on_exit = value["safe_on_exit"].boolean();
  process.may_be_lost = value["may_be_lost"].boolean();
  process.free_running = value["free_running"].boolean();
  process.start_timeout_ns = value["start_timeout"].duration_ns();
  scenario.processes.push_back(std::move(process));
}

bool mentions(const ProcessSection& process, const std::string& unit) {
  for (const CommandWord& word : process.command) {
    for (const CommandWord::Placeholder& placeholder : word.placeholders) {
      if (placeholder.section == "modbus" && placeholder.name == unit) return true;
    }
  }
  return false;
}

/// Refuses a free port (auto) of a client when no process's command names the unit, so that no server knows
/// it.
void check_automatic_ports(const Scenario& scenario, const Reading& reading) {
  for (const ModbusSection& section : scenario.modbus) {
    if (section.port || section.host.empty() || section.role != io::modbus::Role::client) continue;
    bool is_named = false;
    for (const ProcessSection& process : scenario.processes)
      is_named = is_named || mentions(process, section.unit.text);
    if (is_named) continue;
    reading.diagnostics.add(section.device_place,
                            "'device': the port is auto, but no process has it in its command as {modbus." +
                                section.unit.text + "}; name the port of the unit");
  }
}

/// Whether the placeholder gives a process the run's time under the virtual clock.
bool keeps_step(const CommandWord::Placeholder& placeholder, const Scenario& scenario) {
  if (placeholder.section == "clock" || placeholder.section == "can")
    return true;  // every bus is virtual under this clock
  for (const ModbusSection& unit : scenario.modbus) {
    if (unit.unit.text == placeholder.name) return unit.run_time_entry.has_value();
  }
  return true;  // the unit's own mistake is reported elsewhere
}

/// Adds a mistake for each process that can not keep step: its results would differ from run to run.
void check_stepping(const Scenario& scenario, Diagnostics& diagnostics) {
  if (scenario.clock != ClockKind::virtual_time) return;
  for (const ProcessSection& process : scenario.processes) {
    bool steps = !process.enabled || process.free_running;
    for (const CommandWord& word : process.command) {
      for (const CommandWord::Placeholder& placeholder : word.placeholders)
        steps = steps || keeps_step(placeholder, scenario);
    }
    if (steps) continue;
    diagnostics.add(
        process.name.place,
        "'clock: virtual': the process " + in_quotes(process.name.text) +
            " can not keep step with the run: its command has neither {clock}, nor {can.BUS} of a "
            "virtual bus, nor {modbus.UNIT} of a unit with 'run_time'; give it one of these, or set "
            "'free_running: true'");
  }
}

}  // namespace

void read_processes(const Value& root, Scenario& scenario, Reading& reading) {
  bool all_whole = true;
  for (std::size_t i = 0; i < root.entries().size(); ++i) {
    const auto& [key, value] = root.entries()[i];
    if (key != dut_name) continue;
    read_process({dut_name, root.key_place(i)}, value, scenario, reading);
    all_whole = all_whole && is_whole(value);
  }
  const Value* const others = part_of(root, "processes");
  if (others == nullptr) {
    if (all_whole) check_stepping(scenario, reading.diagnostics);
    return;
  }
  for (std::size_t i = 0; i < others->entries().size(); ++i) {
    const auto& [name, value] = others->entries()[i];
    if (name == dut_name) {
      reading.diagnostics.add(others->key_place(i),
                              "'dut' has a section of its own: write it beside 'processes'");
    }
    read_process({name, others->key_place(i)}, value, scenario, reading);
  }
  if (!all_whole || !is_whole(*others)) return;
  check_automatic_ports(scenario, reading);
  check_stepping(scenario, reading.diagnostics);
}

}  // namespace hil::config
