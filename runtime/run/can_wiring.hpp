#pragma once
// The configuration of a CAN device, from a section of the scenario and its DBC file, which gives defaults;
// and what the file tells about signals.

#include <map>
#include <optional>
#include <string>

#include "io/can/can_device.hpp"
#include "runtime/config/scenario.hpp"

namespace hil::run {

/// What of the section fits the DBC file; messages that do not are left out, each with a mistake. Empty when
/// nothing of the bus can be used. Each mistake has the place in the scenario that uses what is wrong, or the
/// place in the DBC file. Statements of the file that are not understood give warnings.
std::optional<io::can::CanDeviceConfig> describe_can_device(const config::Scenario& scenario,
                                                            const config::CanSection& section,
                                                            config::Diagnostics& diagnostics);

/// The physical value of each name that the DBC file gives to a raw value of the signal (VAL_). NaN where a
/// name stands for several values.
std::map<std::string, double> named_values_of(const io::can::DbcSignal& signal);

/// The value with this name; empty with a mistake when there is none, or several.
std::optional<double> value_named(const std::map<std::string, double>& values, const config::Word& name,
                                  const std::string& signal, config::Diagnostics& diagnostics);

/// The physical value of the signal's start value (GenSigStartValue). Empty: the file gives none that the
/// signal can hold.
std::optional<double> start_value_of(const io::can::DbcSignal& signal);

/// Warns of a sent message's signals that nothing sets and that have no start value.
void warn_of_unset_signals(const config::SentMessage& sent, const io::can::DbcMessage& message,
                           config::Diagnostics& diagnostics);

/// "has 64 bits; ..." where a double can not hold every value of the signal; else empty.
std::string precision_warning(const io::can::DbcSignal& signal);

}  // namespace hil::run
