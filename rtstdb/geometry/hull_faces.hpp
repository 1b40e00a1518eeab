#pragma once
// The corners and polygons of a ConvexHull, from the triangles of a hull.
//
// Pure functions: any thread. They allocate.

#include <cstdint>
#include <span>
#include <vector>

#include "rtstdb/geometry/convex_hull.hpp"
#include "rtstdb/geometry/hull_triangles.hpp"

namespace rtstdb {

/// A triangle of a hull, and a face of a ConvexHull.
struct HullFaces {
  ConvexHull hull;                         ///< without triangles of a mesh, box and side
  std::vector<std::uint32_t> of_triangle;  ///< for each triangle of the hull, its face
};

/// Triangles beside each other are one face if their corners are within `flatness_m` of the plane of the
/// largest one, and form a convex polygon.
HullFaces hull_faces(const HullTriangles& hull, std::span<const glm::vec3> points_m, double flatness_m);

/// Sets center_m and half_extent_m.
void set_box(ConvexHull& hull, std::span<const glm::vec3> points_m);

}  // namespace rtstdb
