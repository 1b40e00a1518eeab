#pragma once
// The convex hull of points as a ConvexHull: corners that are near the hull of the others are omitted, and
// triangles that are near a plane are one face.
//
// Pure functions: any thread. They allocate.

#include <glm/ext/vector_float3.hpp>

#include <optional>
#include <span>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/convex_hull.hpp"
#include "rtstdb/geometry/hull_faces.hpp"
#include "rtstdb/geometry/hull_triangles.hpp"

namespace rtstdb {

/// Tolerance of each of the two simplifications of a hull, in ulp; corners of a face are within it of the
/// face's plane.
inline constexpr double simplification_ulp = 0.25 * hull_tolerance_ulp;

/// Upper bound of the distance of omitted corners from the hull of the others. Those of a flat hull may also
/// be off its plane.
float max_omitted_m(std::span<const glm::vec3> points_m, bool is_flat);

/// The hull with its faces, without triangles, from the exact hull of points. Replaces `hull` by the
/// triangles of the simplified hull, and sets `faces` to their faces.
ConvexHull simplified_hull(std::span<const glm::vec3> points_m, HullTriangles& hull, HullFaces& faces);

/// The hull of points, without triangles. Points of less thickness than hull_tolerance_ulp units give a flat
/// hull; empty: they lie in a line, up to that. All coordinates are finite.
std::optional<ConvexHull> convex_hull_of_points(std::span<const glm::vec3> points_m);

}  // namespace rtstdb
