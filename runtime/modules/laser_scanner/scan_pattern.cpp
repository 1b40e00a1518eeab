#include "runtime/modules/laser_scanner/scan_pattern.hpp"

#include <algorithm>
#include <cmath>

namespace hil::modules {

ScanPattern::ScanPattern(const PatternOptions& options) : options_(options) {
  for (std::uint32_t c = 0; c < options.columns; ++c) {
    const double share = (c + 0.5) / options.columns - 0.5;
    azimuths_rad_.push_back((options.left_to_right ? -share : share) * options.horizontal_rad);
    column_directions_.emplace_back(std::cos(azimuths_rad_.back()), std::sin(azimuths_rad_.back()), 1.0);
  }
  for (std::uint32_t r = 0; r < options.rows; ++r) {
    elevations_rad_.push_back(options.elevation_rad +
                              ((r + 0.5) / options.rows - 0.5) * options.vertical_rad);
    const double level = std::cos(elevations_rad_.back());
    row_factors_.emplace_back(level, level, std::sin(elevations_rad_.back()));
  }
}

std::int64_t ScanPattern::time_ns(std::uint64_t beam) const noexcept {
  return static_cast<std::int64_t>(beam * static_cast<std::uint64_t>(options_.period_ns) / beams());
}

std::uint64_t ScanPattern::first_beam_at(std::int64_t offset_ns) const noexcept {
  const auto period = static_cast<std::uint64_t>(options_.period_ns);
  return (static_cast<std::uint64_t>(offset_ns) * beams() + period - 1) / period;
}

std::uint64_t ScanPattern::max_beams_in_step(std::int64_t step_ns) const noexcept {
  std::uint64_t max_beams = 0;
  for (std::int64_t t_ns = 0; t_ns < options_.period_ns; t_ns += step_ns)
    max_beams = std::max(max_beams, first_beam_at(t_ns + step_ns) - first_beam_at(t_ns));
  return max_beams;
}

glm::vec3 ScanPattern::direction(std::uint32_t column, std::uint32_t row) const noexcept {
  return column_directions_[column] * row_factors_[row];
}

double ScanPattern::beam_azimuth_rad(double offset_s) const noexcept {
  const double share = offset_s / (static_cast<double>(options_.period_ns) * 1e-9) - 0.5;
  return (options_.left_to_right ? -share : share) * options_.horizontal_rad;
}

}  // namespace hil::modules
