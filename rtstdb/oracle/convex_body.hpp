#pragma once
// Convex bodies of any number of corners, and the gap between two of them along an axis. Internal to the
// oracle.
//
// The gap along a unit axis n is the least coordinate of the first body along n, minus the largest of the
// second one. The distance of two convex bodies, negative when they penetrate, is the largest gap along any
// axis: the support function of their Minkowski difference. Of bodies that penetrate, the largest gap is
// along the normal of a face of the difference. Such a face is a face of one of the bodies, or the sum of an
// edge of each (Gottschalk, Lin, Manocha, "OBBTree", 1996).

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

/// Two unit directions whose cross product is shorter are parallel.
inline constexpr double parallel_sine = 1e-9;

/// The hull of an entity's corners, relative to a point of the world, world axes.
struct ConvexBody {
  std::vector<glm::dvec3>
      corners_m;  ///< distinct; those that reach farthest along the world's axes come first
  std::vector<std::array<glm::dvec3, 3>> triangles_m;  ///< by their index in the geometry, fronts outside
  /// Indices of the triangles whose planes are known (MeshTree::known_normal).
  std::vector<std::uint32_t> with_plane;
  std::vector<std::array<glm::dvec3, 2>> edges_m;  ///< without those between triangles of one plane
  /// Unit, of triangles; of a flat body also those of its edges, in its plane. Of parallel ones, one.
  std::vector<glm::dvec3> normals;
  std::vector<glm::dvec3> edge_directions;  ///< unit; of parallel ones, one
  double diagonal_m = 0.0;                  ///< of the scaled bounds
  double largest_coordinate_m = 0.0;
  /// How far a corner is in front of a triangle's plane, at most: rounding in the mesh, up to
  /// convex_tolerance.
  double bulge_m = 0.0;
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
/// apart, and another axis of these may have a larger gap.
AxisGap largest_gap(const ConvexBody& first, const ConvexBody& second);

/// Whether an axis at more than `angle_rad` to the unit axis `n` has a gap above `floor_m`. Tests the normals
/// of the faces of the Minkowski difference, and axes at that angle.
bool has_other_axis(const ConvexBody& first, const ConvexBody& second, const glm::dvec3& n, double angle_rad,
                    double floor_m);

/// Whether an axis at `angle_rad` or less to the unit axis `n` has a gap above `floor_m`. Tests the same axes
/// as has_other_axis, and `n`.
bool has_axis_near(const ConvexBody& first, const ConvexBody& second, const glm::dvec3& n, double angle_rad,
                   double floor_m);

struct BodyDistance {
  double distance_m = std::numeric_limits<double>::infinity();
  glm::dvec3 p_first_m{0.0}, p_second_m{0.0};
};

/// The shortest segment between the surfaces of two bodies that are apart: from a corner to a triangle, or
/// between edges.
BodyDistance surface_distance(const ConvexBody& first, const ConvexBody& second);

/// Distance of a point from the surface of the body, not negative.
double surface_distance_m(const ConvexBody& body, const glm::dvec3& point_m);

/// How far the point is behind the known planes of triangles; negative if it is in front of one.
double depth_inside_m(const ConvexBody& body, const glm::dvec3& point_m);

}  // namespace rtstdb::oracle
