#pragma once
// Value names in expressions whose results are values of a signal: `D` as the value of a gear.
//
// Threads: the one that wires the run.

#include <map>
#include <optional>
#include <string>

#include <hil/diagnostics.hpp>

#include "runtime/config/expression.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::signals {

/// The expression with its value in place of a value name that is its result, or that of a branch of if. A
/// word that is a signal stays one, as all words do where `values` is empty. Empty with a mistake, which
/// lists the names, where a word is neither. `signal`: the name of what has the values.
std::optional<config::Expression> with_named_values(const config::Expression& expression,
                                                    const std::map<std::string, double>& values,
                                                    const std::string& signal, const KnownSignals& known,
                                                    config::Diagnostics& diagnostics);

}  // namespace hil::signals
