// gain: the signal is multiplied by the value of an expression.

#include <hil/unit.hpp>

#include "runtime/injection/signal_fault.hpp"

namespace hil::injection {
namespace {

class GainAction final : public ValueAction {
 public:
  using ValueAction::ValueAction;
  void act_on(signals::SignalValue& signal, std::int64_t /*time_ns*/) noexcept override {
    signal.value *= number_;
  }
};

class GainFault final : public ValueFault {
 public:
  using ValueFault::ValueFault;
  std::string sentence() const override { return "multiplied by " + value().text(); }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const override {
    const signals::SignalInfo& signal = context.signal;
    if (units::difference_unit(signal.unit).symbol != signal.unit) {
      context.refuse(value(), ": a gain of '" + signal.name + "', a temperature in " + signal.unit +
                                  ", depends on where its scale begins; use 'offset', or give the signal "
                                  "the unit K");
      return nullptr;
    }
    auto compiled = context.compile(value(), {});
    if (!compiled) return nullptr;
    context.refuse_without_effect(value(), *compiled, 1.0);
    return std::make_unique<GainAction>(std::move(*compiled));
  }
};

}  // namespace

config::FaultKind gain_signal_fault() {
  return {.key = "gain",
          .about = "Of a signal: a factor.",
          .schema = config::Schema::text,
          .read = read_value_fault<GainFault>,
          .cell_example = "gain 1.1",
          .read_cell = read_value_cell<GainFault>};
}

}  // namespace hil::injection
