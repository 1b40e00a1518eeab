// sine: mean + amplitude * sin(2 pi t / period + phase), with the values at the begin of the part.

#include <cmath>
#include <numbers>

#include "runtime/injection/waveform.hpp"
#include "runtime/injection/waveforms/period.hpp"

namespace hil::injection {
namespace {

class SineWaveform final : public Waveform {
 public:
  /// `phase`: in turns.
  SineWaveform(std::vector<config::Expression> mean_and_amplitude, std::int64_t period_ns, double phase)
      : Waveform(std::move(mean_and_amplitude)), period_ns_(period_ns), phase_(phase) {}

  bool compile(WaveformCompiler& compiler) const override {
    return compiler.add_value(expression(0)) && compiler.add_difference(expression(1));
  }
  double value(const WaveformInstant& part) const noexcept override {
    return part.values[0] + part.values[1] * std::sin(2.0 * std::numbers::pi *
                                                      (phase_of(part.passed_ns, period_ns_) + phase_));
  }

 private:
  const std::int64_t period_ns_;
  const double phase_;
};

config::Schema sine_waveform_schema() {
  return config::Schema::record(
      {config::Field::needed("mean", config::Schema::text(), "The mean."),
       config::Field::needed("amplitude", config::Schema::text(), "The amplitude."), period_field(),
       config::Field::with_default("phase", config::Schema::quantity(config::Quantity::angle_rad, -1e3, 1e3),
                                   "0 deg", "The angle at the begin.")});
}

std::shared_ptr<const config::Waveform> read_sine_waveform(const config::Value& value,
                                                           const config::WaveformContext& context) {
  auto mean = config::Expression::parse(value["mean"], context.diagnostics);
  auto amplitude = config::Expression::parse(value["amplitude"], context.diagnostics);
  return waveform_of<SineWaveform>({std::move(mean), std::move(amplitude)}, read_period(value, context),
                                   value["phase"].number() / (2.0 * std::numbers::pi));
}

}  // namespace

config::WaveformKind sine_waveform() {
  return {.key = "sine", .about = "A sine.", .schema = sine_waveform_schema, .read = read_sine_waveform};
}

}  // namespace hil::injection
