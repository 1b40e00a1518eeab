// drift: the time since the begin, multiplied by the value of an expression, is added to the signal.

#include "runtime/injection/signal_fault.hpp"

namespace hil::injection {
namespace {

class DriftAction final : public ValueAction {
 public:
  using ValueAction::ValueAction;
  void begin(std::int64_t time_ns) noexcept override { began_ns_ = time_ns; }
  void act_on(signals::SignalValue& signal, std::int64_t time_ns) noexcept override {
    signal.value += number_ * 1e-9 * static_cast<double>(time_ns - began_ns_);
  }

 private:
  std::int64_t began_ns_ = 0;
};

class DriftFault final : public ValueFault {
 public:
  using ValueFault::ValueFault;
  std::string sentence() const override { return "drift of " + value().text(); }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const override {
    FaultValueUnit unit = added_value_unit(context.signal.unit);
    unit.is_difference = false;
    unit.is_rate = true;
    auto compiled = context.compile(value(), std::move(unit));
    if (!compiled) return nullptr;
    context.refuse_without_effect(value(), *compiled, 0.0);
    return std::make_unique<DriftAction>(std::move(*compiled));
  }
};

}  // namespace

config::FaultKind drift_signal_fault() {
  return {.key = "drift",
          .about = "Of a signal: a change per second since the begin, which is added.",
          .schema = config::Schema::text,
          .read = read_value_fault<DriftFault>,
          .cell_example = "drift 1 mm/s",
          .read_cell = read_value_cell<DriftFault>};
}

}  // namespace hil::injection
