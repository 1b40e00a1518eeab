#pragma once
// Convex bodies of few corners, and how far they are apart, in double precision. Internal to the oracle.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstddef>
#include <limits>

#include "rtstdb/geometry/motion_bounds.hpp"

namespace rtstdb::oracle {

/// At most so many of a kind; an array without a heap, since there is one for each triangle.
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
  Points<6> normals;  ///< unit, of faces; of what is flat also those of its edges within its plane
  Points<6> edges;    ///< unit, each direction once
};

Polyhedron polyhedron_of(const OrientedBox& box);
/// Of a triangle without area: the line or the point that it is.
Polyhedron polyhedron_of(const std::array<glm::dvec3, 3>& triangle_m);

/// The largest gap along any axis that could separate them, negative when they overlap. More than `enough_m` may
/// be less than that.
double separation_m(const Polyhedron& a, const Polyhedron& b,
                    double enough_m = std::numeric_limits<double>::infinity());

}  // namespace rtstdb::oracle
