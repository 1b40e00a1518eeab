// delay: the signal has the value from some time before.

#include <hil/quantity.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/injection/delay_line.hpp"
#include "runtime/injection/signal_fault.hpp"

namespace hil::injection {
namespace {

class DelayAction final : public SignalAction {
 public:
  DelayAction(std::int64_t delay_ns, std::int64_t base_period_ns)
      : delay_ns_(delay_ns), line_(static_cast<std::size_t>(delay_ns / base_period_ns) + 2) {}
  void act_on(signals::SignalValue& signal, std::int64_t time_ns) noexcept override {
    signal = line_.at(time_ns - delay_ns_, signal);
  }
  void keep(const signals::SignalValue& signal, std::int64_t time_ns) noexcept override {
    line_.keep(signal, time_ns);
  }

 private:
  const std::int64_t delay_ns_;
  DelayLine line_;
};

class DelayFault final : public SignalFault {
 public:
  explicit DelayFault(std::int64_t delay_ns) : delay_ns_(delay_ns) {}
  std::string sentence() const override { return "delayed by " + config::format_duration(delay_ns_); }
  std::string period_problem(std::int64_t base_period_ns) const override {
    if (delay_ns_ % base_period_ns == 0) return {};
    return "a delay of " + config::format_duration(delay_ns_) + " is no multiple of the base period of " +
           config::format_duration(base_period_ns);
  }
  std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const override {
    return std::make_unique<DelayAction>(delay_ns_, context.base_period_ns);
  }

 private:
  const std::int64_t delay_ns_;
};

config::Schema delay_schema() {
  return config::duration_schema(config::min_duration_s, config::max_fault_delay_s);
}

std::shared_ptr<const config::FaultEffect> read_delay(const config::Value& value,
                                                      const config::FaultContext& context) {
  if (context.period_ns > 0)
    config::multiple_of(value, context.period_ns, "delay", "the base period", context.diagnostics);
  return std::make_shared<const DelayFault>(value.duration_ns());
}

std::shared_ptr<const config::FaultEffect> read_delay_cell(const config::Word& value,
                                                           config::Diagnostics& diagnostics) {
  const auto reading = config::read_quantity(value.text, config::Quantity::duration_s);
  if (!reading.fault.empty()) {
    diagnostics.add(value.place, config::in_quotes(value.text) + " " + reading.fault);
  } else if (reading.nanoseconds <= 0 || reading.value_si > config::max_fault_delay_s) {
    diagnostics.add(value.place,
                    config::in_quotes(value.text) + " is out of range; it can be above 0 s, up to 60 s");
  }
  return std::make_shared<const DelayFault>(reading.nanoseconds);
}

}  // namespace

config::FaultKind delay_signal_fault() {
  return {.key = "delay",
          .about = "How late a signal is (a multiple of the base period)",
          .schema = delay_schema,
          .read = read_delay,
          .cell_example = "delay 50 ms",
          .read_cell = read_delay_cell};
}

}  // namespace hil::injection
