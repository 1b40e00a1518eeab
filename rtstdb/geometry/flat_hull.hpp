#pragma once
// Bodies without thickness: closed meshes that cover a convex polygon on both sides.
//
// Pure functions: any thread. They allocate. Time n log n for n triangles.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <optional>
#include <span>

#include "rtstdb/geometry/convex_hull.hpp"

namespace rtstdb {

/// The hull of points in a plane, up to rounding: a polygon with a face on both sides, the first one toward
/// the unit normal, without triangles, box and side. No point is farther than `tolerance_m` from the polygon
/// of those that are corners, seen along the normal. Empty: the polygon is thinner than that.
std::optional<ConvexHull> flat_hull(std::span<const glm::vec3> points_m, const glm::dvec3& normal,
                                    double tolerance_m);

/// Whether the triangles that face the normal, seen along it, cover the first face of the hull as one sheet,
/// up to `tolerance_m` at its border. The mesh is closed. Triangles narrower than the tolerance may face
/// either side.
bool covers_polygon(const ConvexHull& flat, std::span<const glm::vec3> points_m,
                    std::span<const glm::uvec3> triangles, double tolerance_m);

}  // namespace rtstdb
