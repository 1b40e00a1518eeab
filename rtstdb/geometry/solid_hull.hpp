#pragma once
// The hull of a solid (solid.hpp), and the check that a mesh approximates it.
//
// Pure functions: any thread. They allocate.

#include <rtstdb/geometry.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/geometry/convex_parts.hpp"

namespace rtstdb {

/// Errors: bad_input, see GeometryOptions::solid. Its time grows with the number of the mesh's triangles.
Result<ConvexHull> solid_hull(const MeshView& mesh, const Solid& solid);

/// Hull of a solid that a log holds, without checks.
ConvexHull recovered_solid_hull(const MeshView& mesh, const Solid& solid);

/// The mesh, and triangles without area at points of its parts, so that its extents (extents.hpp) are those
/// of both.
TriangleMesh with_points_of_parts(const MeshView& mesh, const ConvexParts& parts);

}  // namespace rtstdb
