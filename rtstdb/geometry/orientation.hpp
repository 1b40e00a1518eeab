#pragma once
// On which side of a plane a point lies, without rounding errors. Most signs follow from an evaluation in
// double precision with a bound of its error; the others from exact arithmetic with sums of doubles.
// Source: Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
// 1997.
//
// Pure functions: any thread, no allocation. All coordinates are finite.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>

namespace rtstdb {

/// The plane of a triangle, for many points.
class OrientedPlane {
 public:
  OrientedPlane() = default;
  OrientedPlane(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) noexcept;

  /// Exact sign of dot(cross(b - a, c - a), d - a): 1 if d is in front of the triangle, whose corners are
  /// counter-clockwise seen from the front, -1 behind it, 0 in its plane.
  int side_of(const glm::vec3& d) const noexcept;
  /// How far the point is in front of the plane; for a triangle with an area.
  double height_m(const glm::dvec3& d) const noexcept;
  /// The triangle's unit normal, within about 1e-13 rad also for needles; zero for a triangle without area.
  const glm::dvec3& normal() const noexcept { return normal_; }
  double area_m2() const noexcept { return 0.5 * twice_area_; }

 private:
  glm::vec3 a_{0.0f}, b_{0.0f}, c_{0.0f};
  glm::dvec3 across_{0.0};    // the cross product
  glm::dvec3 products_{0.0};  // sizes of the terms of the cross product, which bound its rounding error
  glm::dvec3 normal_{0.0};
  double twice_area_ = 0.0;
};

}  // namespace rtstdb
