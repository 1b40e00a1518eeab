#pragma once
// The hull of a convex mesh, as contact queries search it: corners without repetitions, and faces in which
// triangles of one plane are merged.
//
// A closed mesh is convex if every point of its surface, not its corners alone, is within a tolerance of the
// surface of the hull of its corners, and if it covers that surface. The tolerance is convex_tolerance times
// the diagonal of its box, or hull_tolerance_ulp units in the last place of its largest coordinate, whichever
// is more (limits.hpp). The mesh may be turned inside out as a whole. Flat bodies are convex: closed meshes
// of less thickness than that number of units, which cover a convex polygon on both sides. Triangles without
// area do not count.
//
// Pure functions: any thread. They allocate.

#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

struct ConvexHull {
  /// A convex polygon: its corners are face_corners[first_corner, first_corner + corner_count), indices into
  /// corners_m, counter-clockwise seen from outside. Its triangles are those of the mesh that lie in it, in
  /// the same way; a face without any has one of a face nearby.
  struct Face {
    glm::vec3 normal{0.0f};  ///< unit, outward
    std::uint32_t first_corner = 0, corner_count = 0;
    std::uint32_t first_triangle = 0, triangle_count = 0;
  };

  /// A solid with a curved surface (solid_hull.hpp) is the Minkowski sum of the hull of the first
  /// core_corners corners and a ball or a disc around the origin. Its faces are the flat ones alone, with
  /// corners on their rims.
  struct Round {
    glm::vec3 axis{0.0f};  ///< unit: a disc perpendicular to it; zero: a ball
    float radius_m = 0.0f;
    std::uint32_t core_corners = 0;
  };

  /// Entity frame; corners of the mesh. Every other corner of the mesh is within max_omitted_m of their
  /// hull. Corners of a face are as near to a common plane.
  std::vector<glm::vec3> corners_m;
  std::vector<Face> faces;
  std::vector<std::uint32_t> face_corners;
  /// Indices in the mesh. Triangles without area, and those that occur again, are in no face.
  std::vector<std::uint32_t> face_triangles;
  glm::vec3 center_m{0.0f};       ///< of the body's box
  glm::vec3 half_extent_m{0.0f};  ///< of that box
  bool inside_out = false;        ///< the fronts of the mesh are inside
  /// Upper bound of the distance of a corner of the mesh from the hull of corners_m. 0: none was omitted;
  /// otherwise half of hull_tolerance_ulp, for a flat hull 1.5 times that tolerance.
  float max_omitted_m = 0.0f;
  std::optional<Round> round{};
};

/// The hull of a convex mesh; empty: the mesh is not convex. Takes time in proportion to n log n for a convex
/// mesh of n triangles, and usually much less for one that is not convex.
std::optional<ConvexHull> convex_hull_of(const MeshView& mesh);
/// As convex_hull_of, for a mesh that is closed, of at most max_convex_triangles triangles.
std::optional<ConvexHull> convex_hull_of_closed(const MeshView& mesh);

}  // namespace rtstdb
