#include "rtstdb/geometry/mesh_convexity.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/flat_hull.hpp"
#include "rtstdb/geometry/hull_depth.hpp"
#include "rtstdb/geometry/ulp.hpp"

namespace rtstdb {
namespace {

/// Where the surface of a mesh is in the hull of its corners.
class SurfaceCheck {
 public:
  SurfaceCheck(const WeldedMesh& mesh, const HullTriangles& hull, double allowed_m)
      : mesh_(mesh), hull_(hull), allowed_m_(allowed_m), edges_(hull.triangles) {}

  /// Whether every point of the surface is near that of the hull. Also computes unknown_m3.
  bool is_near_hull() {
    for (const glm::uvec3& triangle : mesh_.triangles) {
      const auto depth_m = depth_of(triangle);
      if (!depth_m) return false;
      const OrientedPlane plane(mesh_.points_m[triangle.x], mesh_.points_m[triangle.y],
                                mesh_.points_m[triangle.z]);
      unknown_m3_ += 2.0 * *depth_m * plane.area_m2();
    }
    return true;
  }

  /// Bound of the difference between the volume of the mesh and a multiple of the hull's.
  double unknown_m3() const noexcept { return unknown_m3_; }

 private:
  /// Upper bound of the depth of the triangle's deepest point; empty: above the tolerance.
  std::optional<double> depth_of(const glm::uvec3& triangle) {
    double min_m = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      for (const auto& beside : {edges_.find(a, b), edges_.find(b, a)}) {
        if (!beside) continue;
        double deepest_m = 0.0;
        for (int k = 0; k < 3; ++k)
          deepest_m = std::max(deepest_m, -hull_.planes[*beside].height_m(mesh_.at(triangle[k])));
        min_m = std::min(min_m, deepest_m);
      }
    }
    if (min_m <= allowed_m_) return min_m;
    if (!depths_) depths_.emplace(hull_, mesh_.points_m);
    return depths_->depth_within(mesh_.corners(triangle), allowed_m_);
  }

  const WeldedMesh& mesh_;
  const HullTriangles& hull_;
  double allowed_m_;
  TrianglesByEdge edges_;
  std::optional<HullDepth> depths_;
  double unknown_m3_ = 0.0;
};

/// A signed volume with a bound of its rounding error.
struct Volume {
  double value_m3 = 0.0, rounding_m3 = 0.0;
};

Volume volume_of(std::span<const glm::vec3> points_m, std::span<const glm::uvec3> triangles) {
  constexpr double unit = 1e-13;  // more than that of a sum of max_convex_triangles terms
  const glm::dvec3 origin(points_m[triangles[0].x]);
  Volume volume;
  for (const glm::uvec3& t : triangles) {
    const glm::dvec3 a = glm::dvec3(points_m[t.x]) - origin;
    const glm::dvec3 b = glm::dvec3(points_m[t.y]) - origin;
    const double part_m3 = glm::dot(a, glm::cross(b, glm::dvec3(points_m[t.z]) - origin)) / 6.0;
    volume.value_m3 += part_m3;
    volume.rounding_m3 += unit * std::abs(part_m3);
  }
  return volume;
}

/// Whether the mesh, whose surface is near that of its hull, covers it. Its volume is near a multiple of the
/// hull's then, and the multiple is zero if both sides of walls are its surface. The volume of a thin body
/// may be less than its uncertainty: such a body has to cover the hull as seen along the least extent.
bool covers_hull(const WeldedMesh& mesh, const HullTriangles& hull, const Volume& volume, double unknown_m3,
                 double allowed_m) {
  if (std::abs(volume.value_m3) > unknown_m3 + volume.rounding_m3) return true;
  if (volume_of(mesh.points_m, hull.triangles).value_m3 > 2.0 * (unknown_m3 + volume.rounding_m3))
    return false;
  const auto thin = thin_direction(hull, mesh.points_m, 16.0 * allowed_m);
  if (!thin) return false;
  const auto flat = flat_hull(mesh.points_m, hull.planes[thin->triangle].normal(), allowed_m);
  return flat && covers_polygon(*flat, mesh.points_m, mesh.triangles, allowed_m);
}

}  // namespace

double convexity_tolerance_m(std::span<const glm::vec3> points_m, double diagonal_m) {
  return std::max(convex_tolerance * diagonal_m, hull_tolerance_ulp * ulp_m(points_m));
}

bool is_plainly_not_convex(const MeshView& mesh) {
  constexpr std::size_t max_samples = 4096, max_tested = 1024;
  glm::dvec3 minimum(std::numeric_limits<double>::infinity());
  glm::dvec3 maximum = -minimum;
  for (const glm::vec3& p : mesh.positions_m) {
    minimum = glm::min(minimum, glm::dvec3(p));
    maximum = glm::max(maximum, glm::dvec3(p));
  }
  const std::size_t count = std::min(max_samples, mesh.triangles.size());
  std::vector<glm::vec3> samples_m;
  for (std::size_t i = 0; i < count; ++i)
    samples_m.push_back(mesh.positions_m[mesh.triangles[i * mesh.triangles.size() / count].x]);
  std::vector<glm::vec3> extremes_m;
  for (int i = 0; i < 27; ++i) {
    const glm::vec3 direction(glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1);
    extremes_m.push_back(
        *std::ranges::max_element(samples_m, {}, [&](const glm::vec3& p) { return glm::dot(direction, p); }));
  }
  const auto hull = hull_triangles(extremes_m);
  if (!hull) return false;
  const double allowed_m = convexity_tolerance_m(mesh.positions_m, glm::length(maximum - minimum));
  const std::size_t tested = std::min(max_tested, count);
  for (std::size_t i = 0; i < tested; ++i) {
    const glm::dvec3 p_m(samples_m[i * count / tested]);
    if (std::ranges::all_of(hull->planes,
                            [&](const OrientedPlane& plane) { return plane.height_m(p_m) < -allowed_m; }))
      return true;
  }
  return false;
}

Convexity convexity_of(const WeldedMesh& mesh, const HullTriangles& hull, double allowed_m) {
  SurfaceCheck check(mesh, hull, allowed_m);
  if (!check.is_near_hull()) return Convexity::none;
  const Volume volume = volume_of(mesh.points_m, mesh.triangles);
  if (!covers_hull(mesh, hull, volume, check.unknown_m3(), allowed_m)) return Convexity::none;
  return volume.value_m3 < 0.0 ? Convexity::fronts_inside : Convexity::fronts_outside;
}

}  // namespace rtstdb
