#pragma once
// Convex parts of a geometry that the caller gives (GeometryOptions::convex_parts_m), as hulls like those
// that convex_parts_of finds.
//
// Pure function: any thread. It allocates. Its time grows with the number of the mesh's triangles, plus the
// number of its sample points (mesh_surface.hpp), times the number of the hulls' faces, and with the number
// of the hulls' sample points that are not near the mesh times the number of triangles.

#include <rtstdb/geometry.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/geometry/convex_parts.hpp"

namespace rtstdb {

/// The hulls of the parts. Each triangle of the mesh belongs to the face that is nearest to its centre; a
/// face without any has the triangle that is nearest to its own centre. Errors: bad_input, see
/// GeometryOptions::convex_parts_m.
Result<ConvexParts> given_convex_parts(const MeshView& mesh, const ConvexPartPoints& parts_m);

/// Hulls of the parts of a geometry that a log holds, without checks, so that every log opens. If a part has
/// no hull, the parts are those of the mesh (convex_parts_of).
ConvexParts recovered_convex_parts(const MeshView& mesh, const ConvexPartPoints& parts_m);

}  // namespace rtstdb
