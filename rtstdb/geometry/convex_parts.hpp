#pragma once
// The convex parts of a mesh of separate pieces.
//
// Pure functions: any thread. They allocate.

#include <vector>

#include "rtstdb/geometry/convex_hull.hpp"
#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

using ConvexParts = std::vector<ConvexHull>;

/// The convex parts of a mesh: its hull if it is convex; else the hulls of its pieces (triangles that share
/// corners by index), if all of them are convex and have their fronts on the same side. Empty: neither, or
/// more than max_convex_parts pieces. face_triangles are indices in the whole mesh.
ConvexParts convex_parts_of(const MeshView& mesh);

}  // namespace rtstdb
