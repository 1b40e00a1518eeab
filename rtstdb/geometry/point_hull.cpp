#include "rtstdb/geometry/point_hull.hpp"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "rtstdb/geometry/flat_hull.hpp"
#include "rtstdb/geometry/mesh_surface.hpp"
#include "rtstdb/geometry/ulp.hpp"

namespace rtstdb {
namespace {

/// Whether the hull of some points is within the tolerance of a point: a segment or a triangle of them is.
/// Sets `near` to the points of that.
bool is_near_some(std::span<const glm::vec3> points_m, const std::vector<std::uint32_t>& around,
                  std::uint32_t point, double tolerance_m, std::array<std::uint32_t, 3>& near) {
  const auto at = [&](std::uint32_t i) { return glm::dvec3(points_m[i]); };
  for (std::size_t i = 0; i < around.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      for (std::size_t j = 0; j <= k; ++j) {
        near = {around[i], around[k], around[j]};
        if (distance_to_triangle_m({at(near[0]), at(near[1]), at(near[2])}, at(point)) <= tolerance_m)
          return true;
      }
    }
  }
  return false;
}

/// The corners that are not near the hull of their neighbours. Quickhull has others, since it takes points
/// that are equally far outside a plane, as those of an edge, in any order.
std::vector<std::uint32_t> needed_corners(std::span<const glm::vec3> points_m, const HullTriangles& hull,
                                          double tolerance_m) {
  constexpr std::size_t max_around = 16;  // the number of triangles of corners grows with its cube
  std::vector<std::vector<std::uint32_t>> around(points_m.size());
  for (const glm::uvec3& t : hull.triangles)
    for (int i = 0; i < 3; ++i)
      around[t[i]].push_back(t[(i + 1) % 3]);
  // A corner to which an omitted one is near stays, so that distances do not add up.
  std::vector<char> stays(points_m.size()), is_left_out(points_m.size());
  std::vector<std::uint32_t> needed;
  for (const std::uint32_t corner : hull.corners) {
    std::vector<std::uint32_t> present;
    for (const std::uint32_t neighbour : around[corner])
      if (is_left_out[neighbour] == 0) present.push_back(neighbour);
    std::array<std::uint32_t, 3> near{};
    if (stays[corner] == 0 && present.size() <= max_around &&
        is_near_some(points_m, present, corner, tolerance_m, near)) {
      is_left_out[corner] = 1;
      for (const std::uint32_t other : near)
        stays[other] = 1;
    } else {
      needed.push_back(corner);
    }
  }
  return needed;
}

/// Replaces a hull by that of some of its corners, up to the tolerance.
void reduce_to(HullTriangles& hull, std::span<const glm::vec3> points_m,
               const std::vector<std::uint32_t>& corners, double tolerance_m) {
  std::vector<glm::vec3> corners_m;
  for (const std::uint32_t corner : corners)
    corners_m.push_back(points_m[corner]);
  auto reduced = hull_triangles(corners_m, tolerance_m);
  if (!reduced) return;
  for (std::uint32_t& corner : reduced->corners)
    corner = corners[corner];
  for (glm::uvec3& t : reduced->triangles)
    t = {corners[t.x], corners[t.y], corners[t.z]};
  hull = std::move(*reduced);
}

}  // namespace

float max_omitted_m(std::span<const glm::vec3> points_m, bool is_flat) {
  const double flatness_ulp = is_flat ? hull_tolerance_ulp : 0.0;
  return static_cast<float>((2.001 * simplification_ulp + flatness_ulp) * ulp_m(points_m));
}

ConvexHull simplified_hull(std::span<const glm::vec3> points_m, HullTriangles& hull, HullFaces& faces) {
  const double deviation_m = simplification_ulp * ulp_m(points_m);
  const std::size_t exact_corners = hull.corners.size();
  reduce_to(hull, points_m, std::vector(hull.corners), deviation_m);
  const std::vector<std::uint32_t> needed = needed_corners(points_m, hull, deviation_m);
  if (needed.size() < hull.corners.size()) reduce_to(hull, points_m, needed, 0.0);
  faces = hull_faces(hull, points_m, deviation_m);
  ConvexHull simplified = std::move(faces.hull);
  set_box(simplified, points_m);
  if (hull.corners.size() < exact_corners) simplified.max_omitted_m = max_omitted_m(points_m, false);
  return simplified;
}

std::optional<ConvexHull> convex_hull_of_points(std::span<const glm::vec3> points_m) {
  auto triangles = hull_triangles(points_m);
  if (!triangles) return std::nullopt;
  std::optional<ConvexHull> hull;
  const double ulp = ulp_m(points_m);
  if (const auto thin = thin_direction(*triangles, points_m, hull_tolerance_ulp * ulp)) {
    hull = flat_hull(points_m, triangles->planes[thin->triangle].normal(), simplification_ulp * ulp);
    if (hull) {
      set_box(*hull, points_m);
      hull->max_omitted_m = max_omitted_m(points_m, true);
    }
  } else {
    HullFaces faces;
    hull = simplified_hull(points_m, *triangles, faces);
  }
  return hull;
}

}  // namespace rtstdb
