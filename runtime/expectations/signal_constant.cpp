#include "runtime/expectations/signal_constant.hpp"

#include <cmath>

#include <hil/require.hpp>
#include <hil/unit.hpp>

namespace hil::expectations {
namespace {

/// A constant has no names.
class NoNames final : public expression::Scope {
 public:
  std::optional<expression::Variable> find(std::string_view /*name*/) const override { return std::nullopt; }
  std::vector<std::string> names() const override { return {}; }
};

bool is_constant(const config::Expression& expression) {
  using Operation = config::Expression::Operation;
  for (const config::Expression::Node& node : expression.nodes()) {
    const bool is_word = node.operation == Operation::name || node.operation == Operation::quoted ||
                         node.operation == Operation::call || node.operation == Operation::truth;
    if (is_word) return false;
  }
  return true;
}

}  // namespace

ConstantKind limit_kind(const signals::SignalInfo& signal) {
  return signal.value_kind == units::ValueKind::difference ? ConstantKind::difference : ConstantKind::value;
}

std::optional<double> check_constant(const config::Expression& constant, ConstantKind kind,
                                     const std::string& unit, const std::string& what,
                                     config::Diagnostics& diagnostics) {
  if (!is_constant(constant)) {
    diagnostics.add(constant.place(), what + ": " + config::in_quotes(constant.text()) +
                                          " is not a constant, a number with its unit");
    return std::nullopt;
  }
  units::DifferenceUnit wanted{.symbol = unit};
  if (kind == ConstantKind::difference) wanted = units::difference_unit(unit);
  auto program = expression::Program::compile(
      constant, NoNames(),
      {.unit = wanted.symbol, .is_difference = kind == ConstantKind::difference, .what = what}, {},
      diagnostics);
  if (!program) return std::nullopt;
  const double value = program->evaluate({}, 0.0) * wanted.factor;
  if (std::isfinite(value)) return value;
  diagnostics.add(constant.place(),
                  what + ": " + config::in_quotes(constant.text()) + " is not a finite number");
  return std::nullopt;
}

double constant_value(const config::Expression& constant, ConstantKind kind, const std::string& unit) {
  config::Diagnostics diagnostics;
  const auto value = check_constant(constant, kind, unit, "", diagnostics);
  config::require(value.has_value(), "a constant that wire() has checked");
  return *value;
}

void warn_of_missing_unit(const config::Expression& constant, const signals::SignalInfo& signal,
                          config::Diagnostics& diagnostics) {
  if (!signal.arrives || !signal.unit.empty()) return;
  for (const config::Expression::Node& node : constant.nodes()) {
    if (!node.unit || units::is_si(*node.unit)) continue;
    return diagnostics.warn(constant.place(), units::missing_unit_text(signal.name, *node.unit));
  }
}

}  // namespace hil::expectations
