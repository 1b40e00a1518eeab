// ramp: a straight line from the value before the part to that of an expression at its begin.

#include "runtime/injection/waveform.hpp"

namespace hil::injection {
namespace {

class RampWaveform final : public Waveform {
 public:
  using Waveform::Waveform;
  double value(const WaveformInstant& part) const noexcept override {
    return part.before + (part.values[0] - part.before) * static_cast<double>(part.passed_ns) /
                             static_cast<double>(part.for_ns);
  }
  double at_end(double /*last*/, std::span<const double> values) const noexcept override { return values[0]; }
};

std::shared_ptr<const config::Waveform> read_ramp_waveform(const config::Value& value,
                                                           const config::WaveformContext& context) {
  return waveform_of<RampWaveform>({config::Expression::parse(value, context.diagnostics)});
}

}  // namespace

config::WaveformKind ramp_waveform() {
  return {.key = "ramp",
          .about = "The last value of a ramp, which begins at the value before it and takes 'for'.",
          .needs_duration = true,
          .schema = config::Schema::text,
          .read = read_ramp_waveform};
}

}  // namespace hil::injection
