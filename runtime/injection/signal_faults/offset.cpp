// offset: the value of an expression is added to the signal.

#include "runtime/injection/signal_fault.hpp"

namespace hil::injection {
namespace {

class OffsetAction final : public ValueAction {
 public:
  using ValueAction::ValueAction;
  void act_on(signals::SignalValue& signal, std::int64_t /*time_ns*/) noexcept override {
    signal.value += number_;
  }
};

class OffsetFault final : public ValueFault {
 public:
  using ValueFault::ValueFault;
  std::string sentence() const override { return "offset by " + value().text(); }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const override {
    auto compiled = context.compile(value(), added_value_unit(context.signal.unit));
    if (!compiled) return nullptr;
    context.refuse_without_effect(value(), *compiled, 0.0);
    return std::make_unique<OffsetAction>(std::move(*compiled));
  }
};

}  // namespace

config::FaultKind offset_signal_fault() {
  return {.key = "offset",
          .about = "Of a signal: an expression that is added.",
          .schema = config::Schema::text,
          .read = read_value_fault<OffsetFault>,
          .cell_example = "offset 2 cm",
          .read_cell = read_value_cell<OffsetFault>};
}

}  // namespace hil::injection
