#include "runtime/config/section_readers.hpp"

namespace hil::config {
namespace {

constexpr const char* dut_name = "dut";

/// Null: no type of bus with addresses has this key.
const BusSectionType* find_type(const ReaderContext& reading, const std::string& key) {
  for (const BusSectionType& type : reading.types.buses) {
    if (type.key == key && type.has_address) return &type;
  }
  return nullptr;
}

/// One {section.NAME} of a command word that begins at `begin`; empty with a mistake.
std::optional<CommandWord::Placeholder> read_placeholder(const Value& word, std::size_t begin,
                                                         const ReaderContext& reading) {
  const std::string& text = word.text();
  const auto refuse = [&](const std::string& message) {
    reading.diagnostics.add(word.place_in_text(begin), message);
    return std::nullopt;
  };
  const std::size_t end = text.find('}', begin);
  if (end == std::string::npos) {
    return refuse("this '{' has no '}'; use one of " + all_placeholders(reading.types.buses));
  }
  const std::string inside = text.substr(begin + 1, end - begin - 1);
  if (inside == "clock") return CommandWord::Placeholder{begin, end + 1 - begin, "clock", ""};
  const std::size_t dot = inside.find('.');
  const std::string name = dot == std::string::npos ? "" : inside.substr(dot + 1);
  const BusSectionType* const type = find_type(reading, inside.substr(0, dot));
  if (type == nullptr || name.empty()) {
    return refuse(in_quotes("{" + inside + "}") + " is not a placeholder; the placeholders are " +
                  all_placeholders(reading.types.buses));
  }
  const auto found = reading.bus_names.find(type->key);
  const std::vector<std::string> known =
      found == reading.bus_names.end() ? std::vector<std::string>() : found->second;
  for (const std::string& candidate : known) {
    if (candidate == name) return CommandWord::Placeholder{begin, end + 1 - begin, type->key, name};
  }
  return refuse("there is no " + type->noun + " " + in_quotes(name) +
                (known.empty() ? ": the scenario has none" : suggestion(name, known)));
}

CommandWord read_word(const Value& value, const ReaderContext& reading) {
  CommandWord word{word_of(value), {}};
  const std::string& text = value.text();
  for (std::size_t at = text.find('{'); at != std::string::npos; at = text.find('{', at + 1)) {
    std::optional<CommandWord::Placeholder> placeholder = read_placeholder(value, at, reading);
    if (!placeholder) break;
    word.placeholders.push_back(std::move(*placeholder));
  }
  return word;
}

void read_process(const Word& name, const Value& value, Scenario& scenario, const ReaderContext& reading) {
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

bool refers_to(const CommandWord::Placeholder& placeholder, const BusSection& bus) {
  return placeholder.section == bus.type->key && placeholder.name == bus.name.text;
}

/// Adds a mistake for each bus that does not fit the commands of the processes.
void check_buses(const Scenario& scenario, Diagnostics& diagnostics) {
  for (const std::shared_ptr<const BusSection>& bus : scenario.buses) {
    bool is_in_a_command = false;
    for (const ProcessSection& process : scenario.processes) {
      for (const CommandWord& word : process.command) {
        for (const CommandWord::Placeholder& placeholder : word.placeholders)
          is_in_a_command = is_in_a_command || refers_to(placeholder, *bus);
      }
    }
    bus->check_commands(is_in_a_command, diagnostics);
  }
}

/// Whether the placeholder gives a process the run's time under the virtual clock.
bool gives_run_time(const CommandWord::Placeholder& placeholder, const Scenario& scenario) {
  for (const std::shared_ptr<const BusSection>& bus : scenario.buses) {
    if (refers_to(placeholder, *bus)) return bus->gives_run_time();
  }
  return true;  // the clock, or a bus whose own mistake is reported elsewhere
}

/// Adds a mistake for each process that can not keep step: its results would differ from run to run.
void check_run_time(const Scenario& scenario, const ReaderContext& reading) {
  if (scenario.clock != ClockKind::virtual_time) return;
  for (const ProcessSection& process : scenario.processes) {
    bool has_run_time = !process.enabled || process.free_running;
    for (const CommandWord& word : process.command) {
      for (const CommandWord::Placeholder& placeholder : word.placeholders)
        has_run_time = has_run_time || gives_run_time(placeholder, scenario);
    }
    if (has_run_time) continue;
    reading.diagnostics.add(process.name.place,
                            "'clock: virtual': the process " + in_quotes(process.name.text) +
                                " can not keep step with the run: its command has none of " +
                                run_time_placeholders(reading.types.buses) +
                                "; give it one of these, or set 'free_running: true'");
  }
}

}  // namespace

void read_processes(const Value& root, Scenario& scenario, ReaderContext& reading) {
  bool all_whole = true;
  for (std::size_t i = 0; i < root.entries().size(); ++i) {
    const auto& [key, value] = root.entries()[i];
    if (key != dut_name) continue;
    read_process({dut_name, root.key_place(i)}, value, scenario, reading);
    all_whole = all_whole && is_whole(value);
  }
  const Value* const others = part_of(root, "processes");
  if (others == nullptr) {
    if (all_whole) check_run_time(scenario, reading);
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
  check_buses(scenario, reading.diagnostics);
  check_run_time(scenario, reading);
}

}  // namespace hil::config
