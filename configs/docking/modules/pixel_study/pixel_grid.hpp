#pragma once
// The pixels of a sensor with a square field of view and equal angles between pixels, and the directions of
// samples in them. The sensor looks along its x; azimuth counts to +y (left), elevation to +z (up). Pixel 0
// is at the upper left; pixel (column, row) covers [column, column + 1) x [row, row + 1).
//
// Radians, metres. Threads: constant after construction.

#include <glm/ext/vector_double2.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>

namespace hil::modules {

class PixelGrid {
 public:
  /// Misuse: no pixel, or a field of view that is not between 0 and pi.
  PixelGrid(std::uint32_t pixels, double field_of_view_rad);

  std::uint32_t pixels() const noexcept { return pixels_; }  ///< in a row, and in a column
  double pitch_rad() const noexcept { return pitch_rad_; }

  /// The unit vector through a place of the grid, in pixels.
  glm::dvec3 direction(const glm::dvec2& place) const noexcept;
  /// The place of a direction with a positive x.
  glm::dvec2 place(const glm::dvec3& direction) const noexcept;

 private:
  std::uint32_t pixels_;
  double pitch_rad_;
};

/// The pixels [first, end) of rows and columns.
struct PixelWindow {
  std::uint32_t first_column = 0, end_column = 0;
  std::uint32_t first_row = 0, end_row = 0;

  std::uint32_t width() const noexcept { return end_column - first_column; }
  std::uint64_t size() const noexcept { return std::uint64_t{width()} * (end_row - first_row); }
  bool has(std::uint32_t column, std::uint32_t row) const noexcept {
    return column >= first_column && column < end_column && row >= first_row && row < end_row;
  }
};

/// The pixels of the grid in the smallest window that contains a circle around a place; at least one pixel if
/// the place is in the grid. `radius_px`: in pixels.
PixelWindow window_around(const PixelGrid& grid, const glm::dvec2& place, double radius_px) noexcept;

/// The paper's Equation 2, solved for the distance in metres: the largest one at which an object of this size
/// is at least two samples wide. `samples_per_axis`: in a pixel, along one axis.
double equation_2_distance_m(const PixelGrid& grid, double object_m, std::uint32_t samples_per_axis) noexcept;

}  // namespace hil::modules
