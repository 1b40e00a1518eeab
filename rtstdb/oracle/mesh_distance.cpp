#include "rtstdb/oracle/mesh_distance.hpp"

#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {

MeshPoint MeshDistance::nearest(const glm::dvec3& point_m) const {
  MeshPoint best;
  double limit_m = std::numeric_limits<double>::infinity();
  tree_.walk_near(point_m, glm::dvec3(1.0), limit_m, [&](std::uint32_t triangle) {
    const TrianglePoint on_triangle = nearest_on_triangle(tree_.corners(triangle), point_m);
    const double distance_m = glm::distance(on_triangle.point, point_m);
    if (distance_m >= limit_m) return;
    limit_m = distance_m;
    best = {distance_m, on_triangle.point, triangle};
  });
  return best;
}

bool MeshDistance::is_inside(const glm::dvec3& point_m) const {
  double solid_angle = 0.0;
  for (std::uint32_t triangle = 0; triangle < tree_.triangle_count(); ++triangle) {
    auto corners = tree_.corners(triangle);
    for (glm::dvec3& corner : corners)
      corner -= point_m;
    const auto& [a, b, c] = corners;
    const double la = glm::length(a);
    const double lb = glm::length(b);
    const double lc = glm::length(c);
    const double across = la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    solid_angle += 2.0 * std::atan2(glm::dot(a, glm::cross(b, c)), across);
  }
  return std::abs(solid_angle) > 2.0 * std::numbers::pi;
}

}  // namespace rtstdb::oracle
