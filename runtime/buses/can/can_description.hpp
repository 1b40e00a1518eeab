#pragma once
// The configuration of a CAN device, from a section of the scenario and the defaults of its DBC file; and
// properties of signals in the file.

#include <functional>
#include <map>
#include <optional>
#include <string>

#include <hil/diagnostics.hpp>

#include "io/can/can_device.hpp"
#include "runtime/buses/can/can_section.hpp"

namespace hil::buses::can {

/// The configuration without the messages that do not fit the DBC file, each of which is a mistake. Empty
/// when nothing of the bus can be used. A mistake has the place in the scenario that uses what is wrong, or
/// the place in the DBC file. A statement of the file that is not understood gives a warning.
std::optional<io::can::CanDeviceConfig> describe_can_device(const CanSection& section,
                                                            config::Diagnostics& diagnostics);

/// The physical value of each name that the DBC file gives to a raw value of the signal (VAL_); NaN for a
/// name of several values.
std::map<std::string, double> named_values_of(const io::can::DbcSignal& signal);

/// The physical value of the signal's start value (GenSigStartValue). Empty: the file gives none that fits
/// the signal.
std::optional<double> start_value_of(const io::can::DbcSignal& signal);

/// Warns of the signals of a sent message that nothing sets and that have no start value.
void warn_of_unset_signals(const SentMessage& sent, const io::can::DbcMessage& message,
                           const std::function<bool(const std::string&)>& is_driven,
                           config::Diagnostics& diagnostics);

/// "has 64 bits; ..." for a signal whose values a double can not all represent; else empty.
std::string precision_warning(const io::can::DbcSignal& signal);

}  // namespace hil::buses::can
