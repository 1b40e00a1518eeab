#include "bench/spatial/triangle_box.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace hil::bench {
namespace {

/// Tests the cross product of an edge with one of the box's axes; `on` is a point of the edge.
bool apart_across(const glm::vec3& edge, const glm::vec3& on, const glm::vec3& off, const glm::vec3& half,
                  int axis) {
  const int i = (axis + 1) % 3;
  const int k = (axis + 2) % 3;
  const float s0 = edge[k] * on[i] - edge[i] * on[k];
  const float s1 = edge[k] * off[i] - edge[i] * off[k];
  const float reach = std::abs(edge[k]) * half[i] + std::abs(edge[i]) * half[k];
  return std::min(s0, s1) > reach || std::max(s0, s1) < -reach;
}

}  // namespace

std::vector<Corners> triangles_of(const rtstdb::TriangleMesh& mesh) {
  std::vector<Corners> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const glm::uvec3& corners : mesh.triangles)
    triangles.push_back(
        {mesh.positions_m[corners.x], mesh.positions_m[corners.y], mesh.positions_m[corners.z]});
  return triangles;
}

std::vector<rtstdb::Bounds> boxes_around(std::span<const Corners> triangles) {
  std::vector<rtstdb::Bounds> boxes;
  boxes.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles)
    boxes.push_back({glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))});
  return boxes;
}

bool touches(const rtstdb::Bounds& box, const Corners& triangle) {
  const glm::vec3 center = 0.5f * (box.minimum_m + box.maximum_m);
  const glm::vec3 half = 0.5f * (box.maximum_m - box.minimum_m);
  const glm::vec3 a = triangle[0] - center;
  const glm::vec3 b = triangle[1] - center;
  const glm::vec3 c = triangle[2] - center;
  const glm::vec3 lo = glm::min(a, glm::min(b, c));
  const glm::vec3 hi = glm::max(a, glm::max(b, c));
  for (int axis = 0; axis < 3; ++axis) {
    if (lo[axis] > half[axis] || hi[axis] < -half[axis]) return false;
  }
  const glm::vec3 normal = glm::cross(b - a, c - a);
  if (std::abs(glm::dot(normal, a)) > glm::dot(glm::abs(normal), half)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    if (apart_across(b - a, a, c, half, axis) || apart_across(c - b, b, a, half, axis) ||
        apart_across(a - c, c, b, half, axis))
      return false;
  }
  return true;
}

}  // namespace hil::bench
