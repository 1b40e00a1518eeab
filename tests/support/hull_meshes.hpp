#pragma once
// Convex meshes for tests and benchmarks: closed, with their fronts outside.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>

#include <rtstdb/geometry.hpp>

namespace rtstdb::test {

/// The hull of random points on an ellipsoid around the origin; the same for the same arguments. No two
/// points are close to one another, and all are corners. 4 to some thousands of corners.
TriangleMesh make_random_hull(std::uint64_t seed, std::uint32_t corners, const glm::dvec3& half_axes_m);

/// A flat body in the plane z = 0: a rectangle with a front on both sides.
TriangleMesh make_two_sided_rectangle(double size_x_m, double size_y_m);

}  // namespace rtstdb::test
