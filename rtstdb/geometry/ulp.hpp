#pragma once
// The unit in the last place (ulp) of single precision: the distance of neighbouring values.
//
// Pure functions: any thread.

#include <glm/ext/vector_float3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace rtstdb {

/// Ulp at a finite coordinate; that of the least normal value for smaller ones.
inline double ulp_m(double coordinate_m) noexcept {
  using Single = std::numeric_limits<float>;
  const double size_m = std::max(std::abs(coordinate_m), static_cast<double>(Single::min()));
  return std::ldexp(1.0, std::ilogb(size_m) - (Single::digits - 1));
}

/// Ulp at the largest coordinate of the points.
inline double ulp_m(std::span<const glm::vec3> points_m) noexcept {
  float largest_m = 0.0f;
  for (const glm::vec3& p_m : points_m)
    largest_m = std::max({largest_m, std::abs(p_m.x), std::abs(p_m.y), std::abs(p_m.z)});
  return ulp_m(static_cast<double>(largest_m));
}

}  // namespace rtstdb
