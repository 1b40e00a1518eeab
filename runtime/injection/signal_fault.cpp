#include "runtime/injection/signal_fault.hpp"

#include <hil/splitmix64.hpp>
#include <hil/unit.hpp>

#include "runtime/signals/value_names.hpp"

namespace hil::injection {

#define SIGNAL_FAULT(name) config::FaultKind name##_signal_fault();
#include "runtime/injection/signal_faults/table.def"
#undef SIGNAL_FAULT

const std::vector<config::FaultKind>& signal_fault_kinds() {
#define SIGNAL_FAULT(name) name##_signal_fault(),
  static const std::vector<config::FaultKind> kinds{
#include "runtime/injection/signal_faults/table.def"
  };
#undef SIGNAL_FAULT
  return kinds;
}

FaultValueUnit added_value_unit(const std::string& unit_of_signal) {
  const units::DifferenceUnit difference = units::difference_unit(unit_of_signal);
  return {.symbol = difference.symbol, .factor = difference.factor, .is_difference = true};
}

std::optional<FaultValue> SignalFaultContext::compile(
    const config::Expression& value, FaultValueUnit unit,
    const std::map<std::string, double>& named_values) const {
  const auto named = signals::with_named_values(value, named_values, signal.name, known, diagnostics);
  if (!named) return std::nullopt;
  auto compiled =
      signals::SignalExpression::compile(*named, known,
                                         {.unit = unit.symbol,
                                          .is_difference = unit.is_difference,
                                          .is_rate = unit.is_rate,
                                          .what = "the value of fault '" + section.name.text + "'"},
                                         {.period_ns = base_period_ns, .seed = expression_seed}, diagnostics);
  if (!compiled) return std::nullopt;
  return FaultValue(std::move(*compiled), std::move(unit));
}

void SignalFaultContext::refuse_without_effect(const config::Expression& value, const FaultValue& compiled,
                                               double without_effect) const {
  if (compiled.constant() != without_effect) return;
  refuse(value, " (" + section.effect->sentence() + ") does not change '" + section.subject.text +
                    "'; give another value");
}

}  // namespace hil::injection
