#pragma once
// The directions and times of the beams of a turning-mirror scanner. A sweep of `columns` x `rows` beams
// takes one scan period. Columns follow one another across the horizontal field of view, the rows of a
// column from bottom to top; beam k leaves k / (columns * rows) of a period after the start of the sweep
// (paper, Section 6: one sweep a second, from left to right).
//
// Sensor frame: x forward, y left, z up. Azimuth counts from x to y, elevation from the xy plane to z.

#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <vector>

namespace hil::modules {

struct PatternOptions {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  double horizontal_rad = 0.0;  ///< full field of view
  double vertical_rad = 0.0;
  double elevation_rad = 0.0;  ///< of the middle
  std::int64_t period_ns = 0;
  bool left_to_right = true;
};

class ScanPattern {
 public:
  ScanPattern() = default;
  explicit ScanPattern(const PatternOptions& options);

  std::uint64_t beams() const noexcept { return std::uint64_t{options_.columns} * options_.rows; }
  std::uint32_t columns() const noexcept { return options_.columns; }
  std::uint32_t rows() const noexcept { return options_.rows; }
  const PatternOptions& options() const noexcept { return options_; }

  std::uint32_t column_of(std::uint64_t beam) const noexcept {
    return static_cast<std::uint32_t>(beam / options_.rows);
  }
  std::uint32_t row_of(std::uint64_t beam) const noexcept {
    return static_cast<std::uint32_t>(beam % options_.rows);
  }
  /// Nanoseconds since the start of the sweep.
  std::int64_t time_ns(std::uint64_t beam) const noexcept;
  /// The first beam that leaves at or after `offset_ns` (0 to period); beams() at the end.
  std::uint64_t first_beam_at(std::int64_t offset_ns) const noexcept;
  /// The largest number of beams that leave in one step.
  std::uint64_t max_beams_in_step(std::int64_t step_ns) const noexcept;
  double azimuth_rad(std::uint32_t column) const noexcept { return azimuths_rad_[column]; }
  double elevation_rad(std::uint32_t row) const noexcept { return elevations_rad_[row]; }
  /// Unit vector in the sensor frame.
  glm::vec3 direction(std::uint32_t column, std::uint32_t row) const noexcept;
  /// The angle between two columns.
  double pitch_rad() const noexcept { return options_.horizontal_rad / options_.columns; }
  /// Azimuth of the turning beam `offset_s` seconds after the start of the sweep, also between columns.
  double beam_azimuth_rad(double offset_s) const noexcept;

 private:
  PatternOptions options_;
  std::vector<double> azimuths_rad_, elevations_rad_;
  std::vector<glm::vec3> column_directions_, row_factors_;
};

}  // namespace hil::modules
