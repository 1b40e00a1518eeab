// noise: normally distributed noise is added to the signal, with the value of an expression as its deviation.

#include <hil/numbers.hpp>

#include "runtime/injection/random_numbers.hpp"
#include "runtime/injection/signal_fault.hpp"

namespace hil::injection {
namespace {

class NoiseAction final : public ValueAction {
 public:
  NoiseAction(FaultValue deviation, std::uint64_t seed) : ValueAction(std::move(deviation)), random_(seed) {}
  void begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept override {
    ValueAction::begin_tick(table, time_ns);
    number_ *= random_.normal();
  }
  void act_on(signals::SignalValue& signal, std::int64_t /*time_ns*/) noexcept override {
    signal.value += number_;
  }

 private:
  RandomNumbers random_;
};

class NoiseFault final : public ValueFault {
 public:
  using ValueFault::ValueFault;
  std::string sentence() const override { return "noise of " + value().text(); }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const override {
    auto compiled = context.compile(value(), added_value_unit(context.signal.unit));
    if (!compiled) return nullptr;
    context.refuse_without_effect(value(), *compiled, 0.0);
    if (compiled->constant() && *compiled->constant() < 0.0) {
      const std::string& unit = compiled->unit().symbol;
      context.refuse(value(), ": the standard deviation is " + config::format_number(*compiled->constant()) +
                                  (unit.empty() ? "" : " " + unit) + "; it has to be above 0");
    }
    return std::make_unique<NoiseAction>(std::move(*compiled), context.seed);
  }
};

}  // namespace

config::FaultKind noise_signal_fault() {
  return {.key = "noise",
          .about =
              "Of a signal: the standard deviation of normally distributed noise that is added, from the "
              "run's seed.",
          .schema = config::Schema::text,
          .read = read_value_fault<NoiseFault>,
          .cell_example = "noise 5 mm",
          .read_cell = read_value_cell<NoiseFault>};
}

}  // namespace hil::injection
