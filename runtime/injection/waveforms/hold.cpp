// hold: the value that an expression has at the begin of the part.

#include "runtime/injection/waveform.hpp"

namespace hil::injection {
namespace {

class HoldWaveform final : public Waveform {
 public:
  using Waveform::Waveform;
  double value(const WaveformInstant& part) const noexcept override { return part.values[0]; }
};

std::shared_ptr<const config::Waveform> read_hold_waveform(const config::Value& value,
                                                           const config::WaveformContext& context) {
  return waveform_of<HoldWaveform>({config::Expression::parse(value, context.diagnostics)});
}

}  // namespace

std::shared_ptr<const config::Waveform> held(config::Expression value) {
  return waveform_of<HoldWaveform>({std::move(value)});
}

config::WaveformKind hold_waveform() {
  return {.key = "hold",
          .about = "An expression, whose value is held: a step.",
          .schema = config::Schema::text,
          .read = read_hold_waveform};
}

}  // namespace hil::injection
