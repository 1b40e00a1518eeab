#pragma once
// The nearest point of a triangle or of a box. Internal to the oracle.

#include <glm/ext/vector_double3.hpp>

#include <array>

#include "rtstdb/geometry/motion_bounds.hpp"

namespace rtstdb::oracle {

struct TrianglePoint {
  glm::dvec3 point{0.0};
  double u = 0.0, v = 0.0;  ///< weights of the second and third corner
};

/// A triangle without area is a line or a point.
TrianglePoint nearest_on_triangle(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& p) noexcept;

/// Of the solid box: a point inside is its own nearest point.
glm::dvec3 nearest_in_box(const OrientedBox& box, const glm::dvec3& p) noexcept;

}  // namespace rtstdb::oracle
