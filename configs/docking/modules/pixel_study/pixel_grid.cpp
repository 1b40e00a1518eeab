#include "configs/docking/modules/pixel_study/pixel_grid.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <hil/require.hpp>

namespace hil::modules {

PixelGrid::PixelGrid(std::uint32_t pixels, double field_of_view_rad)
    : pixels_(pixels), pitch_rad_(field_of_view_rad / std::max(pixels, 1u)) {
  config::require(pixels > 0 && field_of_view_rad > 0.0 && field_of_view_rad < std::numbers::pi,
                  "a grid has pixels and a field of view between 0 and pi");
}

glm::dvec3 PixelGrid::direction(const glm::dvec2& place) const noexcept {
  const double half = 0.5 * pixels_;
  const double azimuth = (half - place.x) * pitch_rad_;
  const double elevation = (half - place.y) * pitch_rad_;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

glm::dvec2 PixelGrid::place(const glm::dvec3& direction) const noexcept {
  const double azimuth = std::atan2(direction.y, direction.x);
  const double elevation = std::atan2(direction.z, std::hypot(direction.x, direction.y));
  const double half = 0.5 * pixels_;
  return {half - azimuth / pitch_rad_, half - elevation / pitch_rad_};
}

PixelWindow window_around(const PixelGrid& grid, const glm::dvec2& place, double radius_px) noexcept {
  const auto bound = [&](double at) {
    return static_cast<std::uint32_t>(std::clamp(at, 0.0, static_cast<double>(grid.pixels())));
  };
  return {.first_column = bound(std::floor(place.x - radius_px)),
          .end_column = bound(std::floor(place.x + radius_px) + 1.0),
          .first_row = bound(std::floor(place.y - radius_px)),
          .end_row = bound(std::floor(place.y + radius_px) + 1.0)};
}

double equation_2_distance_m(const PixelGrid& grid, double object_m,
                             std::uint32_t samples_per_axis) noexcept {
  return object_m / (2.0 * std::tan(grid.pitch_rad() / samples_per_axis));
}

}  // namespace hil::modules
