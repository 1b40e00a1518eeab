#pragma once
// How far a mesh reaches along directions other than its axes, so that the box around an entity that is turned fits the mesh and not
// the turned box of the mesh. Pure functions: any thread, no allocation.
//
// The extent along d is h(d) = max dot(d, p) over all points p of the mesh. It is convex, and h(s d) = s h(d) for s >= 0; so from its
// values in some directions follows an upper bound in any between them: where u = sum of s_i d_i with all s_i >= 0, h(u) <= sum of
// s_i h(d_i). Taken are the 26 directions from the middle of a cube through its faces, edges and corners (the 26-DOP of
// Klosowski et al. 1998, "Efficient Collision Detection Using Bounding Volume Hierarchies of k-DOPs"). Of a u whose components are,
// by size, a >= b >= c >= 0 along e_1, e_2 and e_3,
//     u = (a - b) e_1 + (b - c) (e_1 + e_2) + c (e_1 + e_2 + e_3)
// and signs go with the components. Of a ball the bound is 1.13 times as large as need be at most (where a, b, c are as 1 to
// sqrt(2) - 1 to sqrt(3) - sqrt(2)), while its turned box reaches up to 1.73 times as far; of a box it is what the box reaches.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float4.hpp>

#include <array>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

/// Of the bounds of all triangles of a mesh, entity frame: not of their corners alone, because a ray meets a triangle anywhere within its
/// bounds (shaders/query/ray/ray_triangle.glsl).
struct Extents {
  Bounds bounds;  ///< exact; the 6 directions through the faces
  /// Extents seen from the middle of `bounds`, metres times the length of the direction, never too small. A direction has
  /// components of size 1 or 0. Of edges, element k has none along axis k; along the two others, in order, their signs are
  /// ++, +-, -+, --. Of corners the first has +x and the second -x; y and z likewise.
  std::array<glm::vec4, 3> edges;
  std::array<glm::vec4, 2> corners;
};

/// The mesh has passed validate (misuse asserts). About 6 ns a triangle.
Extents extents_of(const MeshView& mesh) noexcept;

/// Of all that is known to lie in the box: those of the box.
Extents extents_of(const Bounds& bounds) noexcept;

/// The bound on h(u) as above, from the middle of the bounds; u has any length. The reference, in double precision, for
/// shaders/common/extents.glsl.
double extent_along(const Extents& extents, const glm::dvec3& u) noexcept;

}  // namespace rtstdb
