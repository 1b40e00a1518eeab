#pragma once
// Whether a closed mesh is convex: every point of its surface is near the surface of the hull of its corners,
// and it covers that surface (convex_hull.hpp).
//
// Pure functions: any thread. They allocate.

#include <cstdint>

#include "rtstdb/geometry/hull_triangles.hpp"
#include "rtstdb/geometry/mesh_view.hpp"
#include "rtstdb/geometry/welded_mesh.hpp"

namespace rtstdb {

/// The distance from the surface of the hull up to which the surface of a mesh is convex.
double convexity_tolerance_m(std::span<const glm::vec3> points_m, double diagonal_m);

/// Finds out that most meshes are not convex, before anything is sorted: a corner is deep inside the hull of
/// a few corners.
bool is_plainly_not_convex(const MeshView& mesh);

enum class Convexity : std::uint8_t { none, fronts_outside, fronts_inside };

/// The convexity of a closed mesh that has a hull, up to the tolerance.
Convexity convexity_of(const WeldedMesh& mesh, const HullTriangles& hull, double allowed_m);

}  // namespace rtstdb
