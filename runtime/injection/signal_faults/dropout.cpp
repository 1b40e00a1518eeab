// dropout: in a share of the ticks there is no value.

#include <limits>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>

#include "runtime/injection/random_numbers.hpp"
#include "runtime/injection/signal_fault.hpp"

namespace hil::injection {
namespace {

class DropoutAction final : public SignalAction {
 public:
  DropoutAction(double share, std::uint64_t seed) : share_(share), random_(seed) {}
  void begin_tick(const signals::SignalTable& /*table*/, std::int64_t /*time_ns*/) noexcept override {
    is_dropped_ = random_.uniform() < share_;
  }
  void act_on(signals::SignalValue& signal, std::int64_t /*time_ns*/) noexcept override {
    if (is_dropped_) signal = {std::numeric_limits<double>::quiet_NaN(), signal.time_ns, false};
  }
  bool acts() const noexcept override { return is_dropped_; }
  bool replaces_value() const noexcept override { return is_dropped_; }

 private:
  const double share_;
  RandomNumbers random_;
  bool is_dropped_ = false;  ///< in this tick
};

class DropoutFault final : public SignalFault {
 public:
  explicit DropoutFault(double share) : share_(share) {}
  std::string sentence() const override {
    return "without value in " + config::format_number(100.0 * share_) + " % of the ticks";
  }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const override {
    return std::make_unique<DropoutAction>(share_, context.seed);
  }

 private:
  const double share_;
};

config::Schema dropout_schema() {
  return config::Schema::quantity(config::Quantity::share, 0.0, 1.0);
}

std::shared_ptr<const config::FaultEffect> read_dropout(const config::Value& value,
                                                        const config::FaultContext& context) {
  return std::make_shared<const DropoutFault>(
      config::read_fault_share(value, "dropout", context.diagnostics));
}

std::shared_ptr<const config::FaultEffect> read_dropout_cell(const config::Word& value,
                                                             config::Diagnostics& diagnostics) {
  const auto reading = config::read_quantity(value.text, config::Quantity::share);
  if (!reading.fault.empty()) {
    diagnostics.add(value.place, config::in_quotes(value.text) + " " + reading.fault);
  } else if (!(reading.value_si >= 0.0 && reading.value_si <= 1.0)) {
    diagnostics.add(value.place,
                    config::in_quotes(value.text) + " is out of range; it can be from 0 % to 100 %");
  }
  return std::make_shared<const DropoutFault>(reading.value_si);
}

}  // namespace

config::FaultKind dropout_signal_fault() {
  return {.key = "dropout",
          .about = "Of a signal: the share of ticks in which there is no value, from the run's seed.",
          .schema = dropout_schema,
          .read = read_dropout,
          .cell_example = "dropout 30 %",
          .read_cell = read_dropout_cell};
}

}  // namespace hil::injection
