#pragma once
// A CAN section of the scenario against its DBC file: the device's configuration, with the defaults that the
// file gives, and what is known of its signals.

#include <map>
#include <optional>
#include <string>

#include "io/can/can_device.hpp"
#include "runtime/config/scenario.hpp"

namespace hil::run {

/// Empty when the section does not fit the database; each mistake stands at the place in the scenario that
/// uses what is wrong, or in the DBC file. Statements of the file that are not understood are warnings.
std::optional<io::can::CanDeviceConfig> describe_can_device(const config::Scenario& scenario,
                                                            const config::CanSection& section,
                                                            config::Diagnostics& diagnostics);

/// The physical value of each name that the DBC file gives to a raw value of the signal (VAL_). Not a number:
/// the name stands for several values.
std::map<std::string, double> named_values_of(const io::can::DbcSignal& signal);

/// The value with this name; empty with a mistake when there is none, or several.
std::optional<double> value_named(const std::map<std::string, double>& values, const config::Word& name,
                                  const std::string& signal, config::Diagnostics& diagnostics);

/// What the signal carries until something sets it: its start value. Empty: the file gives none.
std::optional<double> start_value_of(const io::can::DbcSignal& signal);

/// Warns of a sent message's signals that nothing sets and that have no start value.
void warn_of_unset_signals(const config::SentMessage& sent, const io::can::DbcMessage& message,
                           config::Diagnostics& diagnostics);

/// "has 64 bits; ..." where a double can not hold every value of the signal; else empty.
std::string precision_warning(const io::can::DbcSignal& signal);

}  // namespace hil::run
