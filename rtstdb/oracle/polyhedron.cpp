#include "rtstdb/oracle/polyhedron.hpp"

#include <glm/geometric.hpp>

#include <algorithm>

namespace rtstdb::oracle {
namespace {

/// A cross product shorter than this part of its factors is rounding noise and no direction.
constexpr double min_sine = 1e-10;

struct Span {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

Span span_of(const Polyhedron& body, const glm::dvec3& axis) {
  Span span;
  for (const glm::dvec3& corner_m : body.corners_m) {
    span.low = std::min(span.low, glm::dot(axis, corner_m));
    span.high = std::max(span.high, glm::dot(axis, corner_m));
  }
  return span;
}

}  // namespace

Polyhedron polyhedron_of(const OrientedBox& box) {
  Polyhedron body;
  for (unsigned k = 0; k < 8; ++k) {
    glm::dvec3 corner_m = box.center_m;
    for (unsigned i = 0; i < 3; ++i)
      corner_m += ((k >> i & 1u) != 0 ? 1.0 : -1.0) * box.half_extent_m[static_cast<int>(i)] * box.axis[i];
    body.corners_m.add(corner_m);
  }
  for (const glm::dvec3& axis : box.axis) {
    body.normals.add(axis);
    body.edges.add(axis);
  }
  return body;
}

Polyhedron polyhedron_of(const std::array<glm::dvec3, 3>& triangle_m) {
  Polyhedron body;
  for (std::size_t i = 0; i < 3; ++i) {
    body.corners_m.add(triangle_m[i]);
    const glm::dvec3 edge_m = triangle_m[(i + 1) % 3] - triangle_m[i];
    if (const double length_m = glm::length(edge_m); length_m > 0.0) body.edges.add(edge_m / length_m);
  }
  const glm::dvec3 ab_m = triangle_m[1] - triangle_m[0];
  const glm::dvec3 ac_m = triangle_m[2] - triangle_m[0];
  const glm::dvec3 normal = glm::cross(ab_m, ac_m);
  const double area_m2 = glm::length(normal);
  if (area_m2 <= min_sine * glm::length(ab_m) * glm::length(ac_m)) return body;
  body.normals.add(normal / area_m2);
  for (const glm::dvec3& edge : body.edges)
    body.normals.add(glm::cross(normal / area_m2, edge));
  return body;
}

double separation_m(const Polyhedron& a, const Polyhedron& b, double enough_m) {
  double largest = -std::numeric_limits<double>::infinity();
  const auto enough_along = [&](const glm::dvec3& axis) {
    const Span of_a = span_of(a, axis);
    const Span of_b = span_of(b, axis);
    largest = std::max({largest, of_a.low - of_b.high, of_b.low - of_a.high});
    return largest > enough_m;
  };
  for (const glm::dvec3& normal : a.normals)
    if (enough_along(normal)) return largest;
  for (const glm::dvec3& normal : b.normals)
    if (enough_along(normal)) return largest;
  for (const glm::dvec3& edge_a : a.edges) {
    for (const glm::dvec3& edge_b : b.edges) {
      const glm::dvec3 across = glm::cross(edge_a, edge_b);
      const double sine = glm::length(across);
      // Parallel edges give no axis; the face normals cover this direction.
      if (sine > min_sine && enough_along(across / sine)) return largest;
    }
  }
  return largest;
}

}  // namespace rtstdb::oracle
