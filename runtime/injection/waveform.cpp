#include "runtime/injection/waveform.hpp"

#include <algorithm>

#include <hil/splitmix64.hpp>
#include <hil/unit.hpp>

#include "runtime/signals/value_names.hpp"

namespace hil::injection {

#define WAVEFORM(name) config::WaveformKind name##_waveform();
#include "runtime/injection/waveforms/table.def"
#undef WAVEFORM

config::Waveforms waveforms() {
#define WAVEFORM(name) name##_waveform(),
  static const std::vector<config::WaveformKind> kinds{
#include "runtime/injection/waveforms/table.def"
  };
#undef WAVEFORM
  return {.kinds = kinds, .held = held};
}

bool WaveformCompiler::add(const config::Expression& expression, bool is_difference) {
  seed_ = modules::splitmix64(seed_);
  const auto value =
      signals::with_named_values(expression, driven_.named_values, driven_.name, known_, diagnostics_);
  if (!value) return false;
  const units::DifferenceUnit difference = units::difference_unit(driven_.unit);
  const std::string& unit = is_difference ? difference.symbol : driven_.unit;
  auto compiled = signals::SignalExpression::compile(
      *value, known_, {.unit = unit, .is_difference = is_difference, .what = "'" + driven_.name + "'"},
      {.period_ns = period_ns_, .seed = seed_}, diagnostics_);
  if (!compiled) return false;
  expressions_.push_back({std::move(*compiled), is_difference ? difference.factor : 1.0, unit});
  return true;
}

bool Waveform::compile(WaveformCompiler& compiler) const {
  return std::ranges::all_of(
      expressions_, [&](const config::Expression& expression) { return compiler.add_value(expression); });
}

}  // namespace hil::injection
