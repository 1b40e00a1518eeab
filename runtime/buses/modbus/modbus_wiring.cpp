#include "runtime/buses/modbus/modbus_wiring.hpp"

#include <chrono>
#include <utility>

#include "runtime/buses/modbus/modbus_bus_device.hpp"

namespace hil::buses::modbus {
namespace {

std::unique_ptr<io::Device> device_of(const ModbusSection& section) {
  if (section.role == io::modbus::Role::client) {
    return std::make_unique<io::modbus::ClientDevice>(client_settings(section, {}), section.registers);
  }
  return std::make_unique<io::modbus::ServerDevice>(server_settings(section, {}), section.registers);
}

}  // namespace

ModbusWiring::ModbusWiring(const ModbusSection& section) : section_(section), channels_(device_of(section)) {}

void ModbusWiring::connect(const KnownSignals& known, std::vector<Source>& outputs,
                           config::Diagnostics& diagnostics) const {
  for (const RegisterWrite& write : section_.write) {
    const std::size_t index = output_index(*channels_, write.entry.text);
    if (index == outputs.size()) {
      diagnostics.add(write.entry.place, "hil writes '" + write.entry.text +
                                             "' (run_time or heartbeat); leave it out of 'write'");
      continue;
    }
    if (const double* constant = std::get_if<double>(&write.source)) {
      outputs[index].constant = *constant;
    } else {
      const Word& word = std::get<Word>(write.source);
      const io::ChannelInfo& channel = channels_->outputs()[index];
      outputs[index].signal = known.find(word, diagnostics);
      known.check_unit(outputs[index].signal, channel.name, channel.unit, word.place, diagnostics);
    }
  }
}

std::unique_ptr<BusDevice> ModbusWiring::make_device(RunEnvironment environment) const {
  return std::make_unique<ModbusBusDevice>(section_, std::move(environment.on_thread_start));
}

io::modbus::ClientSettings client_settings(const ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint) {
  using std::chrono::ceil;
  using std::chrono::microseconds;
  using std::chrono::milliseconds;
  using std::chrono::nanoseconds;
  io::modbus::ClientSettings settings;
  settings.name = section.name.text;
  settings.endpoint = endpoint;
  settings.unit = section.unit_id;
  settings.max_gap = section.max_gap;
  settings.response_timeout = ceil<microseconds>(nanoseconds(section.timeout_ns));
  settings.start_timeout = ceil<milliseconds>(nanoseconds(section.start_timeout_ns));
  if (section.max_age_ns) settings.max_age = ceil<milliseconds>(nanoseconds(*section.max_age_ns));
  if (section.run_time_entry) settings.run_time_ms_entry = section.run_time_entry->text;
  if (section.heartbeat_entry) settings.heartbeat_entry = section.heartbeat_entry->text;
  return settings;
}

io::modbus::ServerSettings server_settings(const ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint) {
  io::modbus::ServerSettings settings;
  settings.name = section.name.text;
  settings.endpoint = endpoint;
  settings.limits.max_connections = section.max_clients;
  if (section.max_age_ns) {
    settings.max_age =
        std::chrono::ceil<std::chrono::milliseconds>(std::chrono::nanoseconds(*section.max_age_ns));
  }
  return settings;
}

}  // namespace hil::buses::modbus
