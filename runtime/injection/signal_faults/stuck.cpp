// stuck: the signal has the value of an expression, or its last value before the fault.

#include "runtime/injection/signal_fault.hpp"

namespace hil::injection {
namespace {

class StuckAction final : public ValueAction {
 public:
  using ValueAction::ValueAction;
  void act_on(signals::SignalValue& signal, std::int64_t /*time_ns*/) noexcept override {
    signal = {number_, signal.time_ns, true};
  }
  bool replaces_value() const noexcept override { return true; }
};

class StuckFault final : public ValueFault {
 public:
  using ValueFault::ValueFault;
  std::string sentence() const override { return "stuck at " + value().text(); }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const override {
    auto compiled = context.compile(value(), {.symbol = context.signal.unit}, context.signal.named_values);
    return compiled ? std::make_unique<StuckAction>(std::move(*compiled)) : nullptr;
  }
};

class StuckAtLastAction final : public SignalAction {
 public:
  void begin(std::int64_t /*time_ns*/) noexcept override { takes_last_ = true; }
  void act_on(signals::SignalValue& signal, std::int64_t /*time_ns*/) noexcept override {
    if (std::exchange(takes_last_, false)) last_ = signal.value;
    signal = {last_, signal.time_ns, true};
  }
  bool holds_last_value() const noexcept override { return true; }

 private:
  bool takes_last_ = false;  ///< the next value is the last one
  double last_ = 0.0;
};

class StuckAtLastFault final : public SignalFault {
 public:
  std::string sentence() const override { return "stuck at its last value"; }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& /*context*/) const override {
    return std::make_unique<StuckAtLastAction>();
  }
};

std::shared_ptr<const config::FaultEffect> read_stuck(const config::Value& value,
                                                      const config::FaultContext& context) {
  if (value.text() == "last") return std::make_shared<const StuckAtLastFault>();
  return read_value_fault<StuckFault>(value, context);
}

std::shared_ptr<const config::FaultEffect> read_stuck_cell(const config::Word& value,
                                                           config::Diagnostics& diagnostics) {
  if (value.text.empty() || value.text == "last") return std::make_shared<const StuckAtLastFault>();
  return read_value_cell<StuckFault>(value, diagnostics);
}

}  // namespace

config::FaultKind stuck_signal_fault() {
  return {.key = "stuck",
          .about = "Of a signal: an expression, or 'last': the value before the fault.",
          .schema = config::Schema::text,
          .read = read_stuck,
          .read_cell = read_stuck_cell};
}

}  // namespace hil::injection
