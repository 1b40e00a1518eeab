#pragma once
// Which signals a run records: names, and patterns in which `*` stands for any characters, dots included.
//
// Threads: the one that wires the run.

#include <string_view>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::recording {

/// `pattern` and `name` agree where `*` stands for any number of any characters.
bool matches(std::string_view pattern, std::string_view name) noexcept;

/// The signals of the section, each once, in the order of the table. A name or pattern without a signal is a
/// mistake, unless the part that would have declared it has one.
std::vector<signals::SignalId> selected_signals(const config::Recording& section,
                                                const signals::KnownSignals& known,
                                                config::Diagnostics& diagnostics);

}  // namespace hil::recording
