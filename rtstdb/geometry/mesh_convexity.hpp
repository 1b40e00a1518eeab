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

/// The depth below the surface of its hull up to which a mesh counts as convex.
double convexity_tolerance_m(std::span<const glm::vec3> points_m, double diagonal_m);

/// A fast test that recognises most meshes that are not convex: a corner is deep inside the hull of a few
/// others. False: undecided.
bool is_plainly_not_convex(const MeshView& mesh);

enum class Convexity : std::uint8_t {
  none,            ///< not convex
  fronts_outside,  ///< the triangles are counter-clockwise as seen from outside
  fronts_inside,
};

/// The convexity of a closed mesh that has a hull, up to the tolerance.
Convexity convexity_of(const WeldedMesh& mesh, const HullTriangles& hull, double allowed_m);

}  // namespace rtstdb
