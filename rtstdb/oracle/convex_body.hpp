#pragma once
// Convex bodies of any number of corners, and the gap between two of them along an axis. Internal to the
// oracle.
//
// The gap along a unit axis n is the least coordinate of the first body along n, minus the largest of the
// second one. The distance of two convex bodies, negative when they penetrate, is the largest gap along any
// axis: the support function of their Minkowski difference. Of bodies that penetrate, the largest gap is
// along the normal of a face of the difference. Such a face is a face of one of the bodies, or the sum of an
// edge of each (Gottschalk, Lin, Manocha, "OBBTree", 1996). Two edges have such a sum where their arcs on the
// sphere of normals cross (Gregorius, "The separating axis test between convex polyhedra", 2013).

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "rtstdb/oracle/posed_ray.hpp"

namespace rtstdb::oracle {

/// The hull of an entity's corners, relative to a point of the world, world axes.
struct ConvexBody {
  struct Face {
    std::array<glm::dvec3, 3> corners_m;
    glm::dvec3 normal;  ///< unit, outward
  };
  struct Edge {
    std::array<glm::dvec3, 2> ends_m;
    std::array<glm::dvec3, 2> normals;  ///< ends of its arc on the sphere of normals, less than half a turn
  };

  std::vector<glm::dvec3>
      corners_m;  ///< distinct; those that reach farthest along the world's axes come first
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<glm::dvec3> normals;  ///< of faces; of a flat body also those of its edges, in its plane
  std::vector<std::array<glm::dvec3, 3>> triangles_m;  ///< by their index in the geometry
  double diagonal_m = 0.0;                             ///< of the scaled bounds
  double ulp_m = 0.0;  ///< the larger one of its mesh, scaled, and of its scaled coordinates
};

/// The entity's geometry is convex.
ConvexBody convex_body(const PosedEntity& entity, const glm::dvec3& origin_m);

/// The gap along the unit axis. If it is not above `floor_m`, the result is not above `floor_m` either, but
/// may be larger than the gap.
double gap_along_m(const ConvexBody& first, const ConvexBody& second, const glm::dvec3& axis,
                   double floor_m = -std::numeric_limits<double>::infinity()) noexcept;

struct AxisGap {
  double gap_m = -std::numeric_limits<double>::infinity();
  glm::dvec3 axis{0.0};  ///< unit, from the second body to the first
};

/// The largest gap along the normals of the faces of the Minkowski difference. Above zero: the bodies are
/// apart, and another axis may have a larger gap.
AxisGap largest_gap(const ConvexBody& first, const ConvexBody& second);

struct BodyDistance {
  double distance_m = std::numeric_limits<double>::infinity();
  glm::dvec3 p_first_m{0.0}, p_second_m{0.0};
};

/// The shortest segment between the surfaces of two bodies that are apart: from a corner to a triangle, or
/// between edges.
BodyDistance surface_distance(const ConvexBody& first, const ConvexBody& second);

/// Distance of a point from the surface of the body, not negative.
double surface_distance_m(const ConvexBody& body, const glm::dvec3& point_m);

/// How far the point is behind the planes of the faces; negative if it is in front of one.
double depth_inside_m(const ConvexBody& body, const glm::dvec3& point_m);

}  // namespace rtstdb::oracle
