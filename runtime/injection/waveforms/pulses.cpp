// pulses: high for a share of each period, then low, with the values at the begin of the part.

#include "runtime/injection/waveform.hpp"
#include "runtime/injection/waveforms/period.hpp"

namespace hil::injection {
namespace {

class PulsesWaveform final : public Waveform {
 public:
  /// `width`: the share of a period that is high.
  PulsesWaveform(std::vector<config::Expression> low_and_high, std::int64_t period_ns, double width)
      : Waveform(std::move(low_and_high)), period_ns_(period_ns), width_(width) {}

  double value(const WaveformInstant& part) const noexcept override {
    return part.values[phase_of(part.passed_ns, period_ns_) < width_ ? 1 : 0];
  }

 private:
  const std::int64_t period_ns_;
  const double width_;
};

config::Schema pulses_waveform_schema() {
  return config::Schema::record(
      {config::Field::needed("low", config::Schema::text(), "The value between pulses."),
       config::Field::needed("high", config::Schema::text(), "The value of a pulse."), period_field(),
       config::Field::with_default("width", config::Schema::quantity(config::Quantity::share, 0.0, 1.0),
                                   "50 %", "The share of a period that is high.")});
}

std::shared_ptr<const config::Waveform> read_pulses_waveform(const config::Value& value,
                                                             const config::WaveformContext& context) {
  auto low = config::Expression::parse(value["low"], context.diagnostics);
  auto high = config::Expression::parse(value["high"], context.diagnostics);
  return waveform_of<PulsesWaveform>({std::move(low), std::move(high)}, read_period(value, context),
                                     value["width"].number());
}

}  // namespace

config::WaveformKind pulses_waveform() {
  return {.key = "pulses",
          .about = "Pulses; a period begins with its pulse.",
          .schema = pulses_waveform_schema,
          .read = read_pulses_waveform};
}

}  // namespace hil::injection
