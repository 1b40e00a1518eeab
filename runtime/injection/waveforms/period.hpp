#pragma once
// The period of the periodic waveforms.

#include <cstdint>

#include <hil/quantity.hpp>

#include "runtime/config/shared_schemas.hpp"
#include "runtime/config/stimulus_section.hpp"

namespace hil::injection {

inline config::Field period_field() {
  return config::Field::needed("period", config::duration_schema(config::min_duration_s), "The period.");
}

/// Of a value with a period_field(). A mistake where ticks do not show the shape.
inline std::int64_t read_period(const config::Value& value, const config::WaveformContext& context) {
  const config::Value& period = value["period"];
  if (period.duration_ns() < 2 * context.period_ns) {
    context.diagnostics.add(period.place(), "'period': " + config::format_duration(period.duration_ns()) +
                                                " is shorter than two base periods of " +
                                                config::format_duration(context.period_ns) +
                                                ", so the ticks do not show the shape; give at least " +
                                                config::format_duration(2 * context.period_ns));
  }
  return period.duration_ns();
}

/// The share of a period that has passed.
inline double phase_of(std::int64_t passed_ns, std::int64_t period_ns) noexcept {
  return static_cast<double>(passed_ns % period_ns) / static_cast<double>(period_ns);
}

}  // namespace hil::injection
