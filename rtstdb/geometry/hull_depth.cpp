#include "rtstdb/geometry/hull_depth.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace rtstdb {
namespace {

double distance_m(const glm::dvec3& minimum, const glm::dvec3& maximum, const glm::dvec3& p_m) {
  return glm::length(glm::max(glm::max(minimum - p_m, p_m - maximum), glm::dvec3(0.0)));
}

glm::dvec3 mean_of(const std::vector<glm::dvec3>& polygon_m) {
  glm::dvec3 sum_m(0.0);
  for (const glm::dvec3& p_m : polygon_m)
    sum_m += p_m;
  return sum_m / static_cast<double>(polygon_m.size());
}

/// The centre of area of a convex polygon.
glm::dvec3 center_of(const std::vector<glm::dvec3>& polygon_m) {
  glm::dvec3 sum(0.0);
  double weights = 0.0;
  for (std::size_t i = 2; i < polygon_m.size(); ++i) {
    const glm::dvec3& a = polygon_m[0];
    const double area = glm::length(glm::cross(polygon_m[i - 1] - a, polygon_m[i] - a));
    sum += area * (a + polygon_m[i - 1] + polygon_m[i]) / 3.0;
    weights += area;
  }
  return weights > 0.0 ? sum / weights : mean_of(polygon_m);
}

/// The part of a polygon that is more than the depth behind the plane.
std::vector<glm::dvec3> part_below(const std::vector<glm::dvec3>& polygon_m, const OrientedPlane& plane,
                                   double depth_m) {
  std::vector<glm::dvec3> part;
  for (std::size_t i = 0; i < polygon_m.size(); ++i) {
    const glm::dvec3& from = polygon_m[i];
    const glm::dvec3& to = polygon_m[(i + 1) % polygon_m.size()];
    const double of_from = -plane.height_m(from) - depth_m;
    const double of_to = -plane.height_m(to) - depth_m;
    if (of_from > 0.0) part.push_back(from);
    if ((of_from > 0.0) != (of_to > 0.0)) part.push_back(from + of_from / (of_from - of_to) * (to - from));
  }
  return part;
}

}  // namespace

HullDepth::HullDepth(const HullTriangles& hull, std::span<const glm::vec3> points_m)
    : hull_(hull), points_m_(points_m), order_(hull.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  centers_m_.reserve(order_.size());
  for (const glm::uvec3& t : hull.triangles)
    centers_m_.push_back((glm::dvec3(points_m[t.x]) + glm::dvec3(points_m[t.y]) + glm::dvec3(points_m[t.z])) /
                         3.0);
  build(0, static_cast<std::uint32_t>(order_.size()));
}

void HullDepth::build(std::uint32_t first, std::uint32_t end) {
  constexpr std::uint32_t triangles_per_leaf = 4;
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  Node node{.minimum = glm::dvec3(std::numeric_limits<double>::infinity()),
            .maximum = glm::dvec3(-std::numeric_limits<double>::infinity()),
            .first = first,
            .end = end};
  for (std::uint32_t i = first; i < end; ++i) {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 corner_m(points_m_[hull_.triangles[order_[i]][k]]);
      node.minimum = glm::min(node.minimum, corner_m);
      node.maximum = glm::max(node.maximum, corner_m);
    }
  }
  nodes_.push_back(node);
  if (end - first <= triangles_per_leaf) return;
  const glm::dvec3 extent = node.maximum - node.minimum;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  const std::uint32_t middle = (first + end) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(centers_m_[a][axis], a) < std::pair(centers_m_[b][axis], b);
                   });
  build(first, middle);
  nodes_[index].right = static_cast<std::uint32_t>(nodes_.size());
  build(middle, end);
}

template <class Visit>
void HullDepth::walk(const glm::dvec3& point_m, const double& limit_m, Visit&& visit) const {
  std::vector<std::pair<double, std::uint32_t>> pending{
      {distance_m(nodes_[0].minimum, nodes_[0].maximum, point_m), 0}};
  while (!pending.empty()) {
    const auto [node_m, index] = pending.back();
    pending.pop_back();
    if (node_m > limit_m) continue;
    const Node& node = nodes_[index];
    if (node.right == 0) {
      for (std::uint32_t i = node.first; i < node.end; ++i)
        visit(order_[i]);
      continue;
    }
    const auto of_child = [&](std::uint32_t child) {
      return std::pair(distance_m(nodes_[child].minimum, nodes_[child].maximum, point_m), child);
    };
    auto near = of_child(index + 1), far = of_child(node.right);
    if (far < near) std::swap(near, far);
    pending.push_back(far);
    pending.push_back(near);
  }
}

HullDepth::Nearest HullDepth::nearest(const glm::dvec3& point_m, double enough_m) const {
  Nearest best{.depth_m = std::numeric_limits<double>::infinity()};
  double limit_m = best.depth_m;
  walk(point_m, limit_m, [&](std::uint32_t triangle) {
    const double depth_m = -hull_.planes[triangle].height_m(point_m);
    if (depth_m >= best.depth_m) return;
    best = {depth_m, triangle};
    limit_m = depth_m <= enough_m ? -1.0 : depth_m;
  });
  return best;
}

std::uint32_t HullDepth::nearest_with_normal(const glm::dvec3& point_m, const glm::dvec3& normal,
                                             double larger_m) const {
  constexpr double enough = 0.999;
  const Nearest nearest_of_all = nearest(point_m, larger_m);
  double limit_m = std::max(nearest_of_all.depth_m, 0.0) + larger_m;
  std::uint32_t best = nearest_of_all.triangle;
  double best_cosine = glm::dot(hull_.planes[best].normal(), normal);
  if (best_cosine >= enough) return best;
  walk(point_m, limit_m, [&](std::uint32_t triangle) {
    const double cosine = glm::dot(hull_.planes[triangle].normal(), normal);
    if (cosine <= best_cosine || -hull_.planes[triangle].height_m(point_m) > limit_m) return;
    best = triangle;
    best_cosine = cosine;
    if (cosine >= enough) limit_m = -1.0;
  });
  return best;
}

// The points that may be too deep form a convex polygon, because the depth is a concave function. Either its
// centre is too deep, or the plane that is nearest to the centre cuts off at least 4/9 of its area.
std::optional<double> HullDepth::depth_within(const std::array<glm::dvec3, 3>& triangle_m,
                                              double allowed_m) const {
  constexpr int max_cuts = 256;
  std::vector<glm::dvec3> polygon_m(triangle_m.begin(), triangle_m.end());
  for (int cut = 0; cut < max_cuts; ++cut) {
    const glm::dvec3 center_m = center_of(polygon_m);
    const Nearest of_center = nearest(center_m, 0.125 * allowed_m);
    if (of_center.depth_m > allowed_m) return std::nullopt;
    const OrientedPlane& plane = hull_.planes[of_center.triangle];
    double deepest_m = 0.0, radius_m = 0.0;
    for (const glm::dvec3& corner_m : polygon_m) {
      deepest_m = std::max(deepest_m, -plane.height_m(corner_m));
      radius_m = std::max(radius_m, glm::distance(corner_m, center_m));
    }
    if (deepest_m <= allowed_m) return cut == 0 ? deepest_m : allowed_m;
    if (radius_m <= 1e-6 * allowed_m) return allowed_m;
    polygon_m = part_below(polygon_m, plane, allowed_m);
    if (polygon_m.empty()) return allowed_m;
  }
  return allowed_m;
}

}  // namespace rtstdb
