#pragma once
// Convex bodies with few corners and their separation, in double precision. Internal to the oracle.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstddef>
#include <limits>

#include "rtstdb/geometry/motion_bounds.hpp"

namespace rtstdb::oracle {

/// A list of limited capacity without heap memory, since there is one per triangle.
template <std::size_t most>
class Points {
 public:
  void add(const glm::dvec3& point) { points_[count_++] = point; }
  const glm::dvec3* begin() const { return points_.data(); }
  const glm::dvec3* end() const { return points_.data() + count_; }

 private:
  std::array<glm::dvec3, most> points_{};
  std::size_t count_ = 0;
};

struct Polyhedron {
  Points<8> corners_m;
  Points<6> normals;  ///< unit, of faces; for a flat body also those of its edges, in its plane
  Points<6> edges;    ///< unit, each direction once
};

Polyhedron polyhedron_of(const OrientedBox& box);
/// A triangle without area gives a line or a point.
Polyhedron polyhedron_of(const std::array<glm::dvec3, 3>& triangle_m);

/// The largest gap along any separating axis, negative when the bodies overlap. A result above `enough_m` may
/// be less than the largest gap.
double separation_m(const Polyhedron& a, const Polyhedron& b,
                    double enough_m = std::numeric_limits<double>::infinity());

}  // namespace rtstdb::oracle
