// sawtooth: a straight line from low to high in each period, with the values at the begin of the part.

#include "runtime/injection/waveform.hpp"
#include "runtime/injection/waveforms/period.hpp"

namespace hil::injection {
namespace {

class SawtoothWaveform final : public Waveform {
 public:
  SawtoothWaveform(std::vector<config::Expression> low_and_high, std::int64_t period_ns)
      : Waveform(std::move(low_and_high)), period_ns_(period_ns) {}

  double value(const WaveformInstant& part) const noexcept override {
    return part.values[0] + (part.values[1] - part.values[0]) * phase_of(part.passed_ns, period_ns_);
  }

 private:
  const std::int64_t period_ns_;
};

config::Schema sawtooth_waveform_schema() {
  return config::Schema::record(
      {config::Field::needed("low", config::Schema::text(), "The value at the begin of a period."),
       config::Field::needed("high", config::Schema::text(), "The value at its end."), period_field()});
}

std::shared_ptr<const config::Waveform> read_sawtooth_waveform(const config::Value& value,
                                                               const config::WaveformContext& context) {
  auto low = config::Expression::parse(value["low"], context.diagnostics);
  auto high = config::Expression::parse(value["high"], context.diagnostics);
  return waveform_of<SawtoothWaveform>({std::move(low), std::move(high)}, read_period(value, context));
}

}  // namespace

config::WaveformKind sawtooth_waveform() {
  return {.key = "sawtooth",
          .about = "Rises, or falls, in each period, and goes back at once.",
          .schema = sawtooth_waveform_schema,
          .read = read_sawtooth_waveform};
}

}  // namespace hil::injection
