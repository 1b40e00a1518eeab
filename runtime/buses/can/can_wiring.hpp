#pragma once
// A CAN bus of a scenario, connected to the signals of a run: the port of runtime/buses for CAN.

#include <memory>
#include <string>
#include <vector>

#include "io/can/can_device.hpp"
#include "runtime/buses/bus.hpp"
#include "runtime/buses/can/can_section.hpp"

namespace hil::buses::can {

class CanWiring final : public BusWiring {
 public:
  /// The section outlives it.
  CanWiring(const CanSection& section, io::can::CanDeviceConfig config);

  const io::can::CanDeviceConfig& config() const noexcept { return config_; }

  const io::Device& channels() const noexcept override { return *channels_; }
  void describe_signals(const std::string& prefix, KnownSignals& known) const override;
  /// A message of a log that the run plays need not come.
  InputRule input_rule(std::size_t group) const override;
  void connect(const KnownSignals& known, std::vector<Source>& outputs,
               config::Diagnostics& diagnostics) const override;
  std::string fault_problem(const InjectedFault& fault) const override;
  std::unique_ptr<BusDevice> make_device(RunEnvironment environment) const override;

 private:
  /// The message that the configuration has under this name. Null: it could not be configured.
  const io::can::DbcMessage* sent(const Word& name) const;
  const io::can::DbcMessage* received(const Word& name) const;
  /// Adds the short names, value names and precision of the message's signals. Null: their names are unknown.
  void describe_message(const Word& name, const io::can::DbcMessage* message, const std::string& prefix,
                        KnownSignals& known) const;
  void connect_message(const SentMessage& sent, const io::can::DbcMessage& message, const KnownSignals& known,
                       std::vector<Source>& outputs, config::Diagnostics& diagnostics) const;

  const CanSection& section_;
  io::can::CanDeviceConfig config_;
  std::unique_ptr<io::can::CanDevice> channels_;  ///< never opened: only its channels are used
};

}  // namespace hil::buses::can
