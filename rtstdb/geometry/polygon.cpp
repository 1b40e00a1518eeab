#include "rtstdb/geometry/polygon.hpp"

#include <glm/common.hpp>
#include <glm/ext/vector_double2.hpp>
#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include <cstddef>

namespace rtstdb {
namespace {

/// Twice the signed area of a triangle in the plane.
double turn(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The polygon projected along its mean normal (Newell's method), so that it is counter-clockwise.
std::vector<glm::dvec2> flattened(std::span<const glm::vec3> positions_m,
                                  std::span<const std::uint32_t> corners) {
  glm::dvec3 normal(0.0);
  const glm::dvec3 first(positions_m[corners.front()]);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec3 a = glm::dvec3(positions_m[corners[i]]) - first;
    const glm::dvec3 b = glm::dvec3(positions_m[corners[(i + 1) % corners.size()]]) - first;
    normal += glm::cross(a, b);
  }
  const glm::dvec3 size = glm::abs(normal);
  const int across = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const int u = (across + 1) % 3;
  const int v = (across + 2) % 3;
  const double side = normal[across] < 0.0 ? -1.0 : 1.0;
  std::vector<glm::dvec2> plane;
  plane.reserve(corners.size());
  for (const std::uint32_t corner : corners) {
    const glm::dvec3 p(positions_m[corner]);
    plane.emplace_back(p[u] * side, p[v]);
  }
  return plane;
}

/// An ear: a convex corner whose triangle contains no other corner.
bool is_ear(const std::vector<glm::dvec2>& plane, const std::vector<std::size_t>& left, std::size_t at) {
  const std::size_t before = left[(at + left.size() - 1) % left.size()];
  const std::size_t after = left[(at + 1) % left.size()];
  const glm::dvec2& a = plane[before];
  const glm::dvec2& b = plane[left[at]];
  const glm::dvec2& c = plane[after];
  if (turn(a, b, c) <= 0.0) return false;
  for (const std::size_t other : left) {
    const glm::dvec2& p = plane[other];
    if (p == a || p == b || p == c) continue;
    if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) return false;
  }
  return true;
}

}  // namespace

void triangulate_polygon(std::span<const glm::vec3> positions_m, std::span<const std::uint32_t> corners,
                         std::vector<glm::uvec3>& places) {
  if (corners.size() < 3) return;
  const std::vector<glm::dvec2> plane = flattened(positions_m, corners);
  std::vector<std::size_t> left(corners.size());
  for (std::size_t i = 0; i < left.size(); ++i)
    left[i] = i;
  while (left.size() > 3) {
    std::size_t ear = 0;
    while (ear < left.size() && !is_ear(plane, left, ear))
      ++ear;
    // No ear: the rest is degenerate or intersects itself, so any corner is taken.
    if (ear == left.size()) ear = 1;
    const std::size_t before = left[(ear + left.size() - 1) % left.size()];
    const std::size_t after = left[(ear + 1) % left.size()];
    places.emplace_back(before, left[ear], after);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  places.emplace_back(left[0], left[1], left[2]);
}

}  // namespace rtstdb
