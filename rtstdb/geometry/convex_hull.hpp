#pragma once
// The hull of a convex mesh, as contact queries search it: corners without repetitions, and faces in which
// triangles of one plane are merged.
//
// A closed mesh is convex if every corner is behind the plane of every triangle, up to convex_tolerance times
// the diagonal of its box; it may also be turned inside out as a whole. Triangles whose plane single
// precision does not determine within this tolerance are not compared. Flat bodies are convex: closed meshes
// whose triangles lie in one plane, on both sides.
//
// Pure functions: any thread. They allocate.

#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <optional>
#include <vector>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

struct ConvexHull {
  /// A polygon: its corners are face_corners[first_corner, first_corner + corner_count), indices into
  /// corners_m, counter-clockwise seen from outside. Its triangles are those of the mesh, in the same way.
  struct Face {
    glm::vec3 normal{0.0f};  ///< unit, outward
    std::uint32_t first_corner = 0, corner_count = 0;
    std::uint32_t first_triangle = 0, triangle_count = 0;
  };

  /// Of a solid with a curved surface (solid_hull.hpp): the Minkowski sum of the hull of the first
  /// core_corners corners and a ball or a disc around the origin. Its faces are the flat ones alone, with
  /// corners on their rims.
  struct Round {
    glm::vec3 axis{0.0f};  ///< unit: a disc perpendicular to it; zero: a ball
    float radius_m = 0.0f;
    std::uint32_t core_corners = 0;
  };

  /// Entity frame; without those inside a face or between two corners of an edge.
  std::vector<glm::vec3> corners_m;
  std::vector<Face> faces;
  std::vector<std::uint32_t> face_corners;
  /// Indices in the mesh. Triangles without area, and those that occur again, are in no face.
  std::vector<std::uint32_t> face_triangles;
  glm::vec3 center_m{0.0f};       ///< of the body's box
  glm::vec3 half_extent_m{0.0f};  ///< of that box
  bool inside_out = false;        ///< the fronts of the mesh are inside
  std::optional<Round> round{};
};

/// The hull of a convex mesh; empty: the mesh is not convex. Takes time in proportion to n log n for a convex
/// mesh of n triangles, and usually much less for one that is not convex.
std::optional<ConvexHull> convex_hull_of(const MeshView& mesh);

using ConvexParts = std::vector<ConvexHull>;

/// The convex parts of a mesh: its hull if it is convex; else the hulls of its pieces (triangles that share
/// corners by index), if all of them are convex and have their fronts on the same side. Empty: neither, or
/// more than max_convex_parts pieces. face_triangles are indices in the whole mesh.
ConvexParts convex_parts_of(const MeshView& mesh);

}  // namespace rtstdb
