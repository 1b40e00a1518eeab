#pragma once
// Normals and colours of the corners of a mesh (TriangleMesh::corner_normals, corner_colors): how a reader of
// a file adds them, and their check. Pure functions; any thread.

#include <glm/ext/vector_double3.hpp>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// Zero for a vector of length zero and for one that is not finite.
glm::dvec3 unit_or_zero(const glm::dvec3& vector) noexcept;

/// Sets the normals of the triangle that was appended last. Zero: the file has none for this corner.
void set_last_normals(TriangleMesh& mesh, const CornerValues& normals);
/// Sets the colours of the triangle that was appended last.
void set_last_colors(TriangleMesh& mesh, const CornerValues& colors);
/// Called after the last triangle. If a corner has a normal, corners without one get that of their triangle,
/// and all have length 1; if a corner has a colour, corners without one become white.
void complete_corner_attributes(TriangleMesh& mesh);

/// The part of validate about corner normals and colours.
Result<void> check_corner_attributes(const TriangleMesh& mesh);

}  // namespace rtstdb
