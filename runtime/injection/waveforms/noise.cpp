// noise: normally distributed numbers, one in each tick, with mean and deviation at the begin of the part.

#include <hil/numbers.hpp>

#include "runtime/injection/waveform.hpp"

namespace hil::injection {
namespace {

class NoiseWaveform final : public Waveform {
 public:
  using Waveform::Waveform;

  bool compile(WaveformCompiler& compiler) const override {
    if (!compiler.add_value(expression(0)) || !compiler.add_difference(expression(1))) return false;
    const auto constant = compiler.last().expression.constant();
    const std::string& unit = compiler.last().unit;
    if (constant && *constant < 0.0) {
      compiler.refuse_last(expression(1).place(),
                           "the standard deviation is " + config::format_number(*constant) +
                               (unit.empty() ? "" : " " + unit) + "; it has to be 0 or above");
    }
    return true;
  }
  double value(const WaveformInstant& part) const noexcept override {
    return part.values[0] + part.values[1] * part.random.normal();
  }
};

config::Schema noise_waveform_schema() {
  return config::Schema::record(
      {config::Field::needed("mean", config::Schema::text(), "The mean."),
       config::Field::needed("deviation", config::Schema::text(), "The standard deviation.")});
}

std::shared_ptr<const config::Waveform> read_noise_waveform(const config::Value& value,
                                                            const config::WaveformContext& context) {
  auto mean = config::Expression::parse(value["mean"], context.diagnostics);
  auto deviation = config::Expression::parse(value["deviation"], context.diagnostics);
  return waveform_of<NoiseWaveform>({std::move(mean), std::move(deviation)});
}

}  // namespace

config::WaveformKind noise_waveform() {
  return {.key = "noise",
          .about = "Normally distributed random values, one in each tick, from the run's seed.",
          .schema = noise_waveform_schema,
          .read = read_noise_waveform};
}

}  // namespace hil::injection
