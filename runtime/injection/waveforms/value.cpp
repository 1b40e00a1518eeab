// value: the value of an expression in each tick.

#include "runtime/injection/waveform.hpp"

namespace hil::injection {
namespace {

class ValueWaveform final : public Waveform {
 public:
  using Waveform::Waveform;
  double value(const WaveformInstant& part) const noexcept override {
    return part.passed_ns == 0 ? part.values[0] : part.evaluate(0);
  }
};

std::shared_ptr<const config::Waveform> read_value_waveform(const config::Value& value,
                                                            const config::WaveformContext& context) {
  return waveform_of<ValueWaveform>({config::Expression::parse(value, context.diagnostics)});
}

}  // namespace

config::WaveformKind value_waveform() {
  return {.key = "value",
          .about = "An expression, computed in each tick.",
          .schema = config::Schema::text,
          .read = read_value_waveform};
}

}  // namespace hil::injection
