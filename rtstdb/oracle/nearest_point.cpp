#include "rtstdb/oracle/nearest_point.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>

namespace rtstdb::oracle {
namespace {

/// The parameter on the edge from a to b, 0 to 1.
double along_edge(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& p) noexcept {
  const glm::dvec3 edge = b - a;
  const double square = glm::dot(edge, edge);
  return square > 0.0 ? std::clamp(glm::dot(p - a, edge) / square, 0.0, 1.0) : 0.0;
}

}  // namespace

// The nearest of four points: the perpendicular foot on the face, where it lies inside the triangle, and the
// nearest points of the three edges. Slower than classifying Voronoi regions (Ericson, Real-Time Collision
// Detection, 2005, 5.1.5), but right for slivers, for which rounding confuses the regions.
TrianglePoint nearest_on_triangle(const std::array<glm::dvec3, 3>& c, const glm::dvec3& p) noexcept {
  TrianglePoint best;
  double best_square = std::numeric_limits<double>::infinity();
  const auto offer = [&](double u, double v) {
    const glm::dvec3 point = (1.0 - u - v) * c[0] + u * c[1] + v * c[2];
    const double square = glm::dot(point - p, point - p);
    if (square >= best_square) return;
    best_square = square;
    best = {point, u, v};
  };
  offer(along_edge(c[0], c[1], p), 0.0);
  offer(0.0, along_edge(c[0], c[2], p));
  const double along = along_edge(c[1], c[2], p);
  offer(1.0 - along, along);
  const glm::dvec3 ab = c[1] - c[0];
  const glm::dvec3 ac = c[2] - c[0];
  const glm::dvec3 normal = glm::cross(ab, ac);
  const double square = glm::dot(normal, normal);
  if (square > 0.0) {
    const double u = glm::dot(glm::cross(p - c[0], ac), normal) / square;
    const double v = glm::dot(glm::cross(ab, p - c[0]), normal) / square;
    if (u >= 0.0 && v >= 0.0 && u + v <= 1.0) offer(u, v);
  }
  return best;
}

glm::dvec3 nearest_in_box(const OrientedBox& box, const glm::dvec3& p) noexcept {
  glm::dvec3 nearest = box.center_m;
  for (int i = 0; i < 3; ++i) {
    const double along = glm::dot(p - box.center_m, box.axis[i]);
    nearest += std::clamp(along, -box.half_extent_m[i], box.half_extent_m[i]) * box.axis[i];
  }
  return nearest;
}

}  // namespace rtstdb::oracle
