#pragma once
// The convex hull of points, as triangles, with exact signs.
//
// Pure functions: any thread. They allocate. Time: about n log n for n points, as quickhull.

#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <rtstdb/result.hpp>

#include "rtstdb/geometry/orientation.hpp"

namespace rtstdb {

/// Stands for no point, corner or triangle.
inline constexpr std::uint32_t no_index = 0xFFFFFFFFu;

/// A closed surface of triangles with an area, fronts outside: no corner is in front of a triangle. Corners
/// are those of the hull alone: none lies inside a face or an edge.
struct HullTriangles {
  std::vector<std::uint32_t> corners;  ///< indices of points, ascending
  std::vector<glm::uvec3> triangles;   ///< indices of points
  std::vector<OrientedPlane> planes;   ///< of the triangles
};

/// Empty: all points lie in one plane. With a tolerance, points that are not farther than it from the hull of
/// those that are corners need not be corners. All coordinates are finite.
std::optional<HullTriangles> hull_triangles(std::span<const glm::vec3> points_m, double tolerance_m = 0.0);

/// A triangle of a hull along whose normal the hull is thin, and its extent along it.
struct ThinDirection {
  std::uint32_t triangle = 0;
  double extent_m = 0.0;
};

/// Whether a hull is thin: a triangle along whose normal its extent is below the limit. The least extent
/// along normals of triangles is at least the hull's least width, and at most three times that. Takes time in
/// proportion to the number of triangles, if the hull is not nearly that thin.
std::optional<ThinDirection> thin_direction(const HullTriangles& hull, std::span<const glm::vec3> points_m,
                                            double limit_m);

/// The hull of points that have one. Errors: bad_input for a coordinate that is not finite, fewer than four
/// points, and a hull that is thinner than hull_tolerance_ulp units (thin_direction); the message begins with
/// the number of points.
Result<HullTriangles> checked_hull(std::span<const glm::vec3> points_m);

/// Triangles of a hull by their edges.
class TrianglesByEdge {
 public:
  explicit TrianglesByEdge(std::span<const glm::uvec3> triangles);
  /// The triangle with the edge in this direction.
  std::optional<std::uint32_t> find(std::uint32_t from, std::uint32_t to) const;

 private:
  std::vector<std::pair<std::uint64_t, std::uint32_t>> edges_;  ///< sorted
};

/// The triangle beside each edge of each triangle: element i of triangle t is the triangle that has the edge
/// from corner i + 1 to corner i.
std::vector<std::array<std::uint32_t, 3>> neighbors_of(const std::vector<glm::uvec3>& triangles);

}  // namespace rtstdb
