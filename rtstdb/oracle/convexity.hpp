#pragma once
// Whether a mesh is convex, by supports along directions: no hull is built. Internal to the oracle.
//
// The depth of a point below the surface of the hull of some corners is the least value, over all unit
// directions, of the hull's support along the direction minus the point's coordinate. It is attained at the
// normal of a face of the hull, hence at the normal of a plane through three corners.

#include "rtstdb/oracle/mesh_tree.hpp"

namespace rtstdb::oracle {

/// Whether every point of the closed surface is within the tolerance (convex_tolerance, hull_tolerance_ulp)
/// of the surface of the hull of its corners, and the surface covers that of the hull. Meshes of up to
/// max_exact_corners corners are decided with the planes through any three corners; of larger ones, a
/// triangle counts as near the surface only if it is so along the normal of a triangle of the mesh.
bool is_convex_surface(const MeshTree& mesh);

inline constexpr std::size_t max_exact_corners = 24;

}  // namespace rtstdb::oracle
