#pragma once
// The extents of a mesh along directions other than its axes, so that the bounding box of a rotated entity
// fits the mesh and not the rotated box of the mesh. Pure functions: any thread, no allocation.
//
// The extent along d is h(d) = max dot(d, p) over all points p of the mesh (the support function). It is
// convex, and h(s d) = s h(d) for s >= 0. So its values in some directions give an upper bound in any
// direction between them: if u is the sum of s_i d_i with all s_i >= 0, then h(u) <= sum of s_i h(d_i). The
// directions are the 26 from the middle of a cube through its faces, edges and corners (the 26-DOP of
// Klosowski et al., "Efficient Collision Detection Using Bounding Volume Hierarchies of k-DOPs", 1998). If
// the components of u, sorted by size, are a >= b >= c >= 0 along e_1, e_2 and e_3, then
//     u = (a - b) e_1 + (b - c) (e_1 + e_2) + c (e_1 + e_2 + e_3)
// with the signs of the components. For a ball, the bound is at most 1.13 times the extent (where a, b, c are
// as 1 to sqrt(2) - 1 to sqrt(3) - sqrt(2)), while the rotated box has up to 1.73 times the extent. For a
// box, the bound is exact.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float4.hpp>

#include <array>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

/// Extents of the bounds of all triangles of a mesh, entity frame. Of the bounds and not of the corners,
/// because a ray test accepts any point within a triangle's bounds (shaders/query/ray/ray_triangle.glsl).
struct Extents {
  Bounds bounds;  ///< exact: the 6 directions through the faces
  /// Extents from the middle of `bounds`, in metres times the length of the direction, never too small. A
  /// direction has components of size 1 or 0. Element k of `edges` has no component along axis k; the signs
  /// along the other two axes, in order, are ++, +-, -+, --. The first element of `corners` has +x and the
  /// second -x; the signs of y and z follow the same order.
  std::array<glm::vec4, 3> edges;
  std::array<glm::vec4, 2> corners;
};

/// Misuse: a mesh without triangles.
Extents extents_of(const MeshView& mesh) noexcept;

/// The extents of a box.
Extents extents_of(const Bounds& bounds) noexcept;

/// The bound on h(u) from the middle of the bounds, for u of any length. The reference, in double precision,
/// for shaders/common/extents.glsl.
double extent_along(const Extents& extents, const glm::dvec3& u) noexcept;

}  // namespace rtstdb
