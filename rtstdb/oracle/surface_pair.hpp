#pragma once
// Distance, crossing and depth of two surfaces, in double precision. Internal to the oracle. Pure functions.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <limits>
#include <optional>

#include "rtstdb/oracle/surface_body.hpp"

namespace rtstdb::oracle {

/// A segment between two surfaces.
struct SurfaceGap {
  double distance_m = std::numeric_limits<double>::infinity();  ///< 0 where triangles intersect
  glm::dvec3 p_first_m{0.0}, p_second_m{0.0};
  std::uint32_t first_triangle = 0, second_triangle = 0;
};

/// 0 where they intersect.
double triangles_apart_m(const SurfaceTriangle& a, const SurfaceTriangle& b);

/// The shortest segment, with the first surface translated by `move_first_m`. Among pairs of triangles that
/// intersect, any one.
SurfaceGap surface_gap(const SurfaceBody& first, const SurfaceBody& second,
                       const glm::dvec3& move_first_m = glm::dvec3(0.0));

/// An edge of a triangle of one surface that pierces a triangle of the other.
struct SurfaceCrossing {
  /// Distance of the edge from the other triangle's edges and of the edge's ends from the other triangle,
  /// whichever is least: no shorter translation undoes the crossing.
  double margin_m = 0.0;
  glm::dvec3 p_m{0.0};
  std::uint32_t first_triangle = 0, second_triangle = 0;
};

/// The crossing with the largest margin. None: no edge pierces a triangle. Surfaces that touch, and coplanar
/// triangles that overlap, do not cross; their distance is 0 within rounding.
std::optional<SurfaceCrossing> surface_crossing(const SurfaceBody& first, const SurfaceBody& second);

/// The greatest depth of any point of a surface in a body.
struct SurfaceDepth {
  double min_m = 0.0, max_m = 0.0;  ///< bounds of it; 0: no point is inside
  glm::dvec3 p_m{0.0};              ///< a point of the surface as deep as min_m
  glm::dvec3 nearest_m{0.0};        ///< and the nearest point of the body's surface
  std::uint32_t triangle = 0, nearest_triangle = 0;
};

/// By branch and bound over pieces of the surface's triangles: the distance from the body's surface is at
/// most that from one of its triangles, which is a convex function, and so is the mean of two such distances:
/// on a piece of a triangle they are largest at its corners. Bounds are at most `accuracy_m` or 0.2 % apart,
/// unless the search reaches its limit of pieces. Where no depth exceeds `floor_m`, min_m is 0 and max_m at
/// most floor_m + accuracy_m.
SurfaceDepth surface_depth(const SurfaceBody& surface, const SurfaceBody& body, double accuracy_m,
                           double floor_m = 0.0);

}  // namespace rtstdb::oracle
