#pragma once
// The signal of a stimulus or a fault that is 1 while it is active.
//
// Threads: the one that wires the scenario.

#include <string>

#include "runtime/config/expression.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::injection {

/// Adds "fault.NAME" for the noun "fault". Invalid with a mistake when the name is that of another signal.
inline signals::SignalId add_activity_signal(const std::string& noun, const config::Word& name,
                                             const std::string& writer, signals::SignalTable& table,
                                             config::Diagnostics& diagnostics) {
  const std::string active = noun + "." + name.text;
  if (const auto other = table.find(active)) {
    diagnostics.add(name.place, "the signal '" + active + "' is already written by " +
                                    table.info(*other).writer + "; give the " + noun + " another name");
    return {};
  }
  return table.add({.name = active, .unit = "", .writer = writer});
}

}  // namespace hil::injection
