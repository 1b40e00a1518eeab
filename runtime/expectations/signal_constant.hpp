#pragma once
// A constant of an expectation in the unit of a signal: a limit ("5 m") or a difference ("10 cm", of a
// temperature in K).
//
// Threads: the one that wires or opens the run.

#include <optional>
#include <string>

#include "runtime/config/expression.hpp"
#include "runtime/expectations/judge.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

enum class ConstantKind : std::uint8_t { value, difference };

/// The kind of the limits of a signal: `difference` if the signal is a difference of two temperatures, else
/// `value`.
ConstantKind limit_kind(const signals::SignalInfo& signal);

/// In the unit of the signal. The expression was checked.
double constant_value(const config::Expression& constant, ConstantKind kind, const std::string& unit);

/// Adds the mistakes; empty with one. `what`: "'tolerance'".
std::optional<double> check_constant(const config::Expression& constant, ConstantKind kind,
                                     const std::string& unit, const std::string& what,
                                     config::Diagnostics& diagnostics);

/// Warns where the signal has no unit, and the constant one that is not of the SI.
void warn_of_missing_unit(const config::Expression& constant, const signals::SignalInfo& signal,
                          config::Diagnostics& diagnostics);

}  // namespace hil::expectations
