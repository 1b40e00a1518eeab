#include "runtime/buses/modbus/modbus_section.hpp"

#include <array>
#include <chrono>
#include <limits>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>

#include "io/modbus/client_device.hpp"
#include "io/modbus/register_codec.hpp"
#include "io/modbus/tcp_endpoint.hpp"
#include "runtime/buses/modbus/modbus_fault.hpp"
#include "runtime/buses/modbus/modbus_schema.hpp"
#include "runtime/buses/modbus/register_map_file.hpp"
#include "runtime/config/reading.hpp"

namespace hil::buses::modbus {
namespace {

using namespace config;
using io::modbus::RegisterEntry;
using io::modbus::RegisterMap;
using io::modbus::Role;

void read_device(const Value& device, ModbusSection& section, Diagnostics& diagnostics) {
  const std::string& text = device.text();
  section.device_place = device.place();
  const auto parts = io::modbus::split_address(text);
  if (!parts) {
    diagnostics.add(device.place(),
                    "'device': " + in_quotes(text) +
                        " is not HOST:PORT, as in 192.168.0.10:502, [::1]:502 or 127.0.0.1:auto");
    return;
  }
  const std::string& port = parts->port;
  if (port == "auto") {
    section.host = parts->host;
    return;
  }
  const ParsedInteger number = read_integer(port);
  if (!number.fault.empty() || number.value < 1 || number.value > std::numeric_limits<std::uint16_t>::max()) {
    diagnostics.add(device.place(),
                    "'device': the port " + in_quotes(port) + " is neither from 1 to 65535 nor auto");
    return;
  }
  section.host = parts->host;
  section.port = static_cast<std::uint16_t>(number.value);
}

std::vector<std::string> names_of(const RegisterMap& map) {
  std::vector<std::string> names;
  names.reserve(map.entries.size());
  for (const RegisterEntry& entry : map.entries)
    names.push_back(entry.name);
  return names;
}

/// A register named in the scenario has to be in the map and of the right access.
void check_register(const Word& name, bool is_written, const RegisterMap& map, Diagnostics& diagnostics) {
  const RegisterEntry* const entry = map.find(name.text);
  if (entry == nullptr) {
    diagnostics.add(name.place,
                    "unknown register " + in_quotes(name.text) + suggestion(name.text, names_of(map)));
  } else if (entry->writable != is_written) {
    diagnostics.add(name.place, "the register " + in_quotes(name.text) + " is " +
                                    (is_written ? "read, not written" : "written, not read") +
                                    " (access in its map)");
  }
}

/// Adds a mistake for a constant that its register can not hold.
void check_constant(const RegisterWrite& write, const RegisterMap& map, Diagnostics& diagnostics) {
  const double* const constant = std::get_if<double>(&write.source);
  const RegisterEntry* const entry = map.find(write.entry.text);
  if (constant == nullptr || entry == nullptr) return;
  std::array<std::uint16_t, io::modbus::widest_value> registers{};
  if (io::modbus::encode(*entry, *constant, registers) == io::modbus::Conversion::exact) return;
  const io::modbus::ValueRange range = io::modbus::range_of(*entry);
  diagnostics.add(write.source_place, in_quotes(write.entry.text) + ": " + format_number(*constant) +
                                          " is out of range; the register takes " +
                                          format_number(range.lowest) + " to " +
                                          format_number(range.highest));
}

void check_registers(const ModbusSection& section, Diagnostics& diagnostics) {
  for (const RegisterWrite& write : section.write) {
    check_register(write.entry, true, section.registers, diagnostics);
    check_constant(write, section.registers, diagnostics);
  }
  for (const Word& read : section.read)
    check_register(read, false, section.registers, diagnostics);
  if (section.run_time_entry && section.heartbeat_entry &&
      section.run_time_entry->text == section.heartbeat_entry->text) {
    diagnostics.add(section.heartbeat_entry->place, "'heartbeat': the register " +
                                                        in_quotes(section.heartbeat_entry->text) +
                                                        " is already written with the run's time");
  }
  for (const auto& filled : {section.run_time_entry, section.heartbeat_entry}) {
    if (!filled) continue;
    check_register(*filled, true, section.registers, diagnostics);
    for (const RegisterWrite& write : section.write) {
      if (write.entry.text != filled->text) continue;
      diagnostics.add(write.entry.place, "hil writes " + in_quotes(filled->text) +
                                             " (run_time or heartbeat); leave it out of 'write'");
    }
  }
}

/// A client touches only the registers that the scenario names; without `read`, it reads all that can be
/// read.
void keep_used_registers(ModbusSection& section) {
  const auto is_named = [](const std::optional<Word>& word, const RegisterEntry& entry) {
    return word && word->text == entry.name;
  };
  std::erase_if(section.registers.entries, [&](const RegisterEntry& entry) {
    if (!entry.writable)
      return !section.read.empty() &&
             std::ranges::find(section.read, entry.name, &Word::text) == section.read.end();
    const bool is_written = std::ranges::any_of(
        section.write, [&](const RegisterWrite& write) { return write.entry.text == entry.name; });
    return !is_written && !is_named(section.run_time_entry, entry) &&
           !is_named(section.heartbeat_entry, entry);
  });
}

/// What a register is written from. Empty with a mistake when it is neither a signal nor a number.
std::optional<std::variant<Word, double>> source_of_register(const std::string& entry, const Value& value,
                                                             Diagnostics& diagnostics) {
  const std::string& text = value.text();
  if (is_signal_name(text)) return word_of(value);
  const ParsedNumber number = read_number(text);
  if (number.fault.empty() && number.length == text.size()) return number.value;
  const std::string fault =
      number.length > 0 && !number.fault.empty() ? number.fault : "is neither a signal nor a number";
  diagnostics.add(value.place(), in_quotes(entry) + ": " + in_quotes(text) + " " + fault);
  return std::nullopt;
}

void read_names(const Value& value, ModbusSection& section, Diagnostics& diagnostics) {
  const Value& write = value["write"];
  for (std::size_t i = 0; i < write.entries().size(); ++i) {
    const auto& [name, source] = write.entries()[i];
    auto read = source_of_register(name, source, diagnostics);
    if (read) section.write.push_back({{name, write.key_place(i)}, std::move(*read), source.place()});
  }
  UniqueNames names("register", diagnostics);
  for (const Value& read : value["read"].items()) {
    names.add(word_of(read));
    section.read.push_back(word_of(read));
  }
  section.run_time_entry = word_in(value, "run_time");
  section.heartbeat_entry = word_in(value, "heartbeat");
  if (section.role == Role::client) return;
  for (const auto& filled : {section.run_time_entry, section.heartbeat_entry}) {
    if (filled)
      diagnostics.add(filled->place, "a server writes no run time and no heartbeat; only a client does");
  }
}

void read_section(const Value& value, ModbusSection& section, Diagnostics& diagnostics) {
  section.registers_file = value["registers"].text();
  section.timeout_ns = value["timeout"].duration_ns();
  if (value.has("max_age")) section.max_age_ns = value["max_age"].duration_ns();
  section.start_timeout_ns = value["start_timeout"].duration_ns();
  section.unit_id = static_cast<std::uint8_t>(value["unit_id"].integer());
  section.max_gap = static_cast<std::uint16_t>(value["max_gap"].integer());
  section.is_optional = value["optional"].boolean();
  section.max_clients = static_cast<std::size_t>(value["max_clients"].integer());
  read_names(value, section, diagnostics);
  std::optional<RegisterMap> map = load_register_map(section.registers_file, section.role, diagnostics);
  if (!map) return;
  section.registers = std::move(*map);
  const std::size_t before = diagnostics.count();
  check_registers(section, diagnostics);
  if (section.role == Role::server || diagnostics.count() != before) return;
  keep_used_registers(section);
  if (section.registers.entries.empty())
    diagnostics.add(value["registers"].place(),
                    "the scenario neither reads nor writes a register of this map; list registers under "
                    "'read' or 'write'");
}

/// Warns of a max_age that values exceed without a fault: a value is read once per period, and its reply may
/// take the whole time-out.
void warn_of_short_max_age(const Value& value, const ModbusSection& section, const ReaderContext& reading) {
  if (section.role != Role::client || !reading.base || section.registers.read_count() == 0) return;
  const std::int64_t period_ns = section.every_ticks * reading.base->period_ns;
  const std::int64_t needed_ns = period_ns + section.timeout_ns;
  const std::int64_t max_age_ns =
      section.max_age_ns.value_or(std::chrono::nanoseconds(io::modbus::ClientSettings{}.max_age).count());
  if (max_age_ns >= needed_ns) return;
  reading.diagnostics.warn(
      value.has("max_age") ? value["max_age"].place() : value["rate"].place(),
      "'max_age' of " + format_duration(max_age_ns) + " is less than one period of 'rate' (" +
          format_duration(period_ns) + ") and 'timeout' (" + format_duration(section.timeout_ns) +
          ") together: values grow stale although the unit replies in time; set 'max_age' to " +
          format_duration(needed_ns) + " or more, or read more often");
}

/// All addresses of the machine.
bool is_anywhere(const std::string& host) {
  return host == "0.0.0.0" || host == "::";
}

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

std::string without_alias(const std::string& host) {
  return host == "localhost" ? "127.0.0.1" : host;
}

/// Two servers can not listen on one address and port.
bool exclude_each_other(const ModbusSection& first, const ModbusSection& second) {
  return first.role == Role::server && second.role == Role::server && first.port &&
         first.port == second.port &&
         (first.host == second.host || is_anywhere(first.host) || is_anywhere(second.host));
}

/// Whether the client connects to this server, as far as the texts of their addresses show it.
bool connects_to(const ModbusSection& client, const ModbusSection& server) {
  return client.role == Role::client && server.role == Role::server && client.port &&
         client.port == server.port &&
         (without_alias(client.host) == without_alias(server.host) ||
          (is_anywhere(server.host) && is_loopback(client.host)));
}

void check_endpoints(std::span<const std::shared_ptr<const BusSection>> list, ReaderContext& reading) {
  const std::vector<const ModbusSection*> sections = sections_of<ModbusSection>(list);
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const auto earlier = std::span(sections).first(i);
    const auto other = std::ranges::find_if(
        earlier, [&](const auto* one) { return exclude_each_other(*one, *sections[i]); });
    if (other != earlier.end()) {
      reading.diagnostics.add(sections[i]->device_place,
                              "'device': the unit " + in_quotes((*other)->name.text) +
                                  " already listens on port " + std::to_string(*sections[i]->port));
    }
  }
  if (reading.clock != ClockKind::virtual_time) return;
  for (const ModbusSection* client : sections) {
    const auto server =
        std::ranges::find_if(sections, [&](const auto* one) { return connects_to(*client, *one); });
    if (server == sections.end()) continue;
    reading.diagnostics.add(client->device_place,
                            "'device': the unit " + in_quotes((*server)->name.text) +
                                " of this scenario listens there; under 'clock: virtual' it does not reply "
                                "while hil waits for this unit. Use 'clock: realtime'");
  }
}

}  // namespace

void ModbusSection::read_entry(const Value& entry, ReaderContext& reading) {
  if (entry.has("role")) role = entry["role"].text() == "server" ? Role::server : Role::client;
  if (entry.has("device")) read_device(entry["device"], *this, reading.diagnostics);
  if (!is_whole(entry)) return;
  read_section(entry, *this, reading.diagnostics);
  warn_of_short_max_age(entry, *this, reading);
}

void ModbusSection::check_commands(bool is_in_a_command, Diagnostics& diagnostics) const {
  if (is_in_a_command || port || host.empty() || role != Role::client) return;
  diagnostics.add(device_place, "'device': 'auto' needs a process whose command contains {" + full_name() +
                                    "}; give the unit's port instead");
}

BusSectionType modbus_section_type() {
  return {.key = "modbus",
          .about = "The Modbus units.",
          .name_key = "unit",
          .noun = "Modbus unit",
          .plural = "Modbus units",
          .input_noun = "register",
          .entry = modbus_schema(),
          .run_time_condition = "of a unit with run_time",
          .arrival_noun = "value that is read or written",
          .faults = modbus_fault_kinds(),
          .create = []() -> std::unique_ptr<BusSection> { return std::make_unique<ModbusSection>(); },
          .check = check_endpoints};
}

}  // namespace hil::buses::modbus
