#include "runtime/buses/modbus/modbus_wiring.hpp"

#include <utility>

#include "io/modbus/client_device.hpp"
#include "io/modbus/server_device.hpp"
#include "runtime/buses/modbus/modbus_bus_device.hpp"
#include "runtime/buses/modbus/modbus_fault.hpp"
#include "runtime/buses/modbus/modbus_settings.hpp"

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

InputRule ModbusWiring::input_rule(std::size_t group) const {
  const std::string& name = channels_->input_groups()[group].name;
  return {.has_to_come = !section_.is_optional && !section_.registers.find(name)->is_optional};
}

void ModbusWiring::connect(const KnownSignals& known, std::vector<Source>& outputs,
                           config::Diagnostics& diagnostics) const {
  for (const RegisterWrite& write : section_.write) {
    const std::size_t index = io::output_index(*channels_, write.entry.text);
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
      outputs[index].conversion =
          known.conversion_for(outputs[index].signal, channel.name, channel.unit, word.place, diagnostics);
    }
  }
}

std::string ModbusWiring::fault_problem(const InjectedFault& fault) const {
  if (!fault.message.empty()) return "Modbus has no messages; the fault can be one of the unit";
  if (dynamic_cast<const ModbusFault*>(fault.effect.get()) != nullptr) return {};
  return "a Modbus unit can be silent, disconnected, slow ('delay') or answer with an 'exception'";
}

std::unique_ptr<BusDevice> ModbusWiring::make_device(RunEnvironment environment) const {
  return std::make_unique<ModbusBusDevice>(section_, std::move(environment));
}

}  // namespace hil::buses::modbus
