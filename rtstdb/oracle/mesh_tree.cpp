#include "rtstdb/oracle/mesh_tree.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rtstdb::oracle {
namespace {

constexpr std::uint32_t leaf_triangles = 4;

/// Counts edges by direction, identified by the positions of their ends. The mesh is closed when both
/// directions of every edge occur equally often.
bool is_closed(const TriangleMesh& mesh) {
  struct Edge {
    std::array<float, 6> ends;
    int direction;
  };
  const auto place = [&](std::uint32_t corner) {
    const glm::vec3 p = mesh.positions_m[corner] + 0.0f;  // minus zero becomes zero
    return std::array{p.x, p.y, p.z};
  };
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const glm::uvec3& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      auto from = place(triangle[i]);
      auto to = place(triangle[(i + 1) % 3]);
      if (from == to) continue;
      const int direction = from < to ? 1 : -1;
      if (direction < 0) std::swap(from, to);
      edges.push_back({{from[0], from[1], from[2], to[0], to[1], to[2]}, direction});
    }
  }
  std::ranges::sort(edges, {}, &Edge::ends);
  for (std::size_t i = 0; i < edges.size();) {
    int balance = 0;
    const auto& ends = edges[i].ends;
    for (; i < edges.size() && edges[i].ends == ends; ++i)
      balance += edges[i].direction;
    if (balance != 0) return false;
  }
  return true;
}

}  // namespace

MeshTree::MeshTree(const TriangleMesh& mesh)
    : mesh_(mesh), bounds_(bounds_of(mesh)), closed_(is_closed(mesh)), order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<glm::dvec3> centers;
  centers.reserve(order_.size());
  for (std::uint32_t i = 0; i < triangle_count(); ++i) {
    const auto [a, b, c] = corners(i);
    centers.push_back((a + b + c) / 3.0);
  }
  const glm::dvec3 far =
      glm::max(glm::abs(glm::dvec3(bounds_.minimum_m)), glm::abs(glm::dvec3(bounds_.maximum_m)));
  magnitude_ = std::max({far.x, far.y, far.z});
  nodes_.emplace_back();
  build(0, 0, triangle_count(), centers);
  double six_volumes = 0.0;
  const glm::dvec3 origin = corners(0)[0];
  for (std::uint32_t i = 0; i < triangle_count(); ++i) {
    const auto [a, b, c] = corners(i);
    six_volumes += glm::dot(a - origin, glm::cross(b - origin, c - origin));
  }
  inside_out_ = closed_ && six_volumes < 0.0;
  convex_ = is_convex_surface();
}

std::array<glm::dvec3, 3> MeshTree::corners(std::uint32_t triangle) const noexcept {
  const glm::uvec3& t = mesh_.triangles[triangle];
  return {glm::dvec3(mesh_.positions_m[t.x]), glm::dvec3(mesh_.positions_m[t.y]),
          glm::dvec3(mesh_.positions_m[t.z])};
}

// Splits at the median, so the depth is logarithmic for any shape.
void MeshTree::build(std::uint32_t node, std::uint32_t first, std::uint32_t count,
                     const std::vector<glm::dvec3>& centers) {
  glm::dvec3 minimum(std::numeric_limits<double>::infinity());
  glm::dvec3 maximum(-std::numeric_limits<double>::infinity());
  for (std::uint32_t i = first; i < first + count; ++i) {
    for (const glm::dvec3& corner : corners(order_[i])) {
      minimum = glm::min(minimum, corner);
      maximum = glm::max(maximum, corner);
    }
  }
  nodes_[node] = {minimum, maximum, first, count};
  if (count <= leaf_triangles) return;
  const glm::dvec3 size = maximum - minimum;
  const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const std::uint32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(centers[a][axis], a) < std::pair(centers[b][axis], b);
  });
  const auto left_child = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].first = left_child;
  nodes_[node].count = 0;
  build(left_child, first, half, centers);
  build(left_child + 1, first + half, count - half, centers);
}

bool MeshTree::has_corner_beyond(const glm::dvec3& point, const glm::dvec3& normal, double limit) const {
  std::vector<std::uint32_t> pending{0};
  while (!pending.empty()) {
    const Node& node = nodes_[pending.back()];
    pending.pop_back();
    const glm::dvec3 farthest{normal.x > 0.0 ? node.maximum.x : node.minimum.x,
                              normal.y > 0.0 ? node.maximum.y : node.minimum.y,
                              normal.z > 0.0 ? node.maximum.z : node.minimum.z};
    if (glm::dot(normal, farthest - point) <= limit) continue;
    if (node.count == 0) {
      pending.push_back(node.first + 1);
      pending.push_back(node.first);
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      for (const glm::dvec3& corner : corners(order_[node.first + i]))
        if (glm::dot(normal, corner - point) > limit) return true;
    }
  }
  return false;
}

bool MeshTree::meets(const Node& node, const LocalRay& ray, const glm::dvec3& grow) noexcept {
  double enter = ray.lambda_min;
  double leave = ray.lambda_max;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = node.minimum[axis] - grow[axis] - ray.origin[axis];
    const double high = node.maximum[axis] + grow[axis] - ray.origin[axis];
    const double step = ray.direction[axis];
    if (step == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    const double a = low / step;
    const double b = high / step;
    // Enlarged by a few units in the last place, since the quotients are rounded.
    constexpr double unit = 4.0 * std::numeric_limits<double>::epsilon();
    const double first = std::min(a, b);
    const double last = std::max(a, b);
    enter = std::max(enter, first - unit * std::abs(first));
    leave = std::min(leave, last + unit * std::abs(last));
  }
  return enter <= leave;
}

double MeshTree::distance(const Node& node, const glm::dvec3& point, const glm::dvec3& scale) noexcept {
  return glm::length(glm::max(glm::max(scale * node.minimum - point, point - scale * node.maximum), 0.0));
}

}  // namespace rtstdb::oracle
