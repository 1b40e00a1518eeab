#pragma once
// A Modbus unit of a scenario, connected to the signals of a run: the port of runtime/buses for Modbus.

#include <memory>
#include <vector>

#include "runtime/buses/bus.hpp"
#include "runtime/buses/modbus/modbus_section.hpp"

namespace hil::buses::modbus {

class ModbusWiring final : public BusWiring {
 public:
  /// The section outlives it.
  explicit ModbusWiring(const ModbusSection& section);

  const io::Device& channels() const noexcept override { return *channels_; }
  InputRule input_rule(std::size_t group) const override;
  void connect(const KnownSignals& known, std::vector<Source>& outputs,
               config::Diagnostics& diagnostics) const override;
  std::string fault_problem(const InjectedFault& fault) const override;
  std::unique_ptr<BusDevice> make_device(RunEnvironment environment) const override;

 private:
  const ModbusSection& section_;
  std::unique_ptr<io::Device> channels_;
};

}  // namespace hil::buses::modbus
