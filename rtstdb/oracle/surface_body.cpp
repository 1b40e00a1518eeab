#include "rtstdb/oracle/surface_body.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {
namespace {

constexpr std::uint32_t surface_leaf_triangles = 2;
/// A ray whose barycentric coordinate is nearer to 0 is too close to the edge to decide on which side it
/// passes.
constexpr double edge_tolerance = 1e-9;

double square_distance(const SurfaceBox& box, const glm::dvec3& p_m) noexcept {
  const glm::dvec3 apart_m = glm::max(glm::max(box.minimum_m - p_m, p_m - box.maximum_m), 0.0);
  return glm::dot(apart_m, apart_m);
}

bool ray_meets(const SurfaceBox& box, const glm::dvec3& from_m, const glm::dvec3& inverse) noexcept {
  const glm::dvec3 a = (box.minimum_m - from_m) * inverse;
  const glm::dvec3 b = (box.maximum_m - from_m) * inverse;
  const glm::dvec3 low = glm::min(a, b);
  const glm::dvec3 high = glm::max(a, b);
  const double enter = std::max({low.x, low.y, low.z, 0.0});
  const double leave = std::min({high.x, high.y, high.z});
  return enter <= leave + 1e-12 * (std::abs(enter) + std::abs(leave));
}

/// 1 or -1 where the ray leaves or enters through the triangle, 0 where it does not cross it. Empty: the ray
/// is too close to an edge or to the triangle's plane to decide.
std::optional<int> crossing_sign(const SurfaceTriangle& c, const glm::dvec3& from_m,
                                 const glm::dvec3& direction) noexcept {
  const glm::dvec3 ab = c[1] - c[0];
  const glm::dvec3 ac = c[2] - c[0];
  const double size = glm::length(ab) * glm::length(ac);
  const glm::dvec3 normal = glm::cross(ab, ac);
  if (glm::length(normal) <= 1e-14 * size) return 0;
  const double det = glm::dot(direction, normal);
  if (std::abs(det) <= edge_tolerance * glm::length(normal)) return std::nullopt;
  const glm::dvec3 to = from_m - c[0];
  const glm::dvec3 across = glm::cross(to, direction);
  const double u = -glm::dot(ac, across) / det;
  const double v = glm::dot(ab, across) / det;
  const double least = std::min({u, v, 1.0 - u - v});
  if (least < -edge_tolerance) return 0;
  const double lambda = -glm::dot(to, normal) / det;
  if (lambda < 0.0) return 0;
  if (least < edge_tolerance) return std::nullopt;
  return det > 0.0 ? 1 : -1;
}

bool winds_by_solid_angles(std::span<const SurfaceTriangle> triangles, const glm::dvec3& p_m) {
  double half_angles = 0.0;
  for (const SurfaceTriangle& triangle : triangles) {
    const glm::dvec3 a = triangle[0] - p_m;
    const glm::dvec3 b = triangle[1] - p_m;
    const glm::dvec3 c = triangle[2] - p_m;
    const double la = glm::length(a);
    const double lb = glm::length(b);
    const double lc = glm::length(c);
    half_angles += std::atan2(glm::dot(a, glm::cross(b, c)),
                              la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return std::abs(half_angles / (2.0 * std::numbers::pi)) > 0.5;
}

}  // namespace

void SurfaceBox::add(const glm::dvec3& p_m) noexcept {
  minimum_m = glm::min(minimum_m, p_m);
  maximum_m = glm::max(maximum_m, p_m);
}

SurfaceBody::SurfaceBody(const PosedEntity& entity, bool has_inside, const glm::dvec3& origin_m)
    : order_(entity.mesh->triangle_count()), has_inside_(has_inside) {
  const glm::dvec3 offset_m = entity.pose.p_world_m - origin_m;
  const glm::dvec3 scale = entity.state->row.scale;
  std::vector<glm::dvec3> centers;
  for (std::uint32_t i = 0; i < order_.size(); ++i) {
    SurfaceTriangle triangle = entity.mesh->corners(i);
    for (glm::dvec3& corner : triangle) {
      corner = offset_m + entity.pose.q_world * (scale * corner);
      const glm::dvec3 size = glm::abs(corner);
      largest_coordinate_m_ = std::max({largest_coordinate_m_, size.x, size.y, size.z});
    }
    triangles_.push_back(triangle);
    centers.push_back((triangle[0] + triangle[1] + triangle[2]) / 3.0);
  }
  const Bounds& bounds = entity.mesh->bounds();
  diagonal_m_ = glm::length(scale * (glm::dvec3(bounds.maximum_m) - glm::dvec3(bounds.minimum_m)));
  std::iota(order_.begin(), order_.end(), 0u);
  nodes_.emplace_back();
  build(0, 0, static_cast<std::uint32_t>(order_.size()), centers);
}

void SurfaceBody::build(std::uint32_t node, std::uint32_t first, std::uint32_t count,
                        const std::vector<glm::dvec3>& centers) {
  SurfaceBox box;
  for (std::uint32_t i = first; i < first + count; ++i)
    for (const glm::dvec3& corner : triangles_[order_[i]])
      box.add(corner);
  nodes_[node] = {box, first, count};
  if (count <= surface_leaf_triangles) return;
  const glm::dvec3 size = box.maximum_m - box.minimum_m;
  const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const std::uint32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count,
                   [&](std::uint32_t a, std::uint32_t b) { return centers[a][axis] < centers[b][axis]; });
  const auto left = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].first = left;
  nodes_[node].count = 0;
  build(left, first, half, centers);
  build(left + 1, first + half, count - half, centers);
}

SurfacePoint SurfaceBody::nearest(const glm::dvec3& p_m, std::uint32_t hint) const {
  SurfacePoint best;
  double best_square = std::numeric_limits<double>::infinity();
  const auto offer = [&](std::uint32_t triangle) {
    const glm::dvec3 on_triangle = nearest_on_triangle(triangles_[triangle], p_m).point;
    const double square = glm::dot(on_triangle - p_m, on_triangle - p_m);
    if (square >= best_square) return;
    best_square = square;
    best.p_m = on_triangle;
    best.triangle = triangle;
  };
  offer(hint);
  // The depth of the tree is at most 32, and each level adds one entry.
  std::array<std::pair<double, std::uint32_t>, 64> pending;
  std::size_t count = 0;
  pending[count++] = {square_distance(nodes_[0].box, p_m), 0};
  while (count > 0) {
    const auto [node_square, index] = pending[--count];
    if (node_square >= best_square) continue;
    const Node& node = nodes_[index];
    if (node.count == 0) {
      std::pair near{square_distance(nodes_[node.first].box, p_m), node.first};
      std::pair far{square_distance(nodes_[node.first + 1].box, p_m), node.first + 1};
      if (far.first < near.first) std::swap(near, far);
      if (far.first < best_square) pending[count++] = far;
      if (near.first < best_square) pending[count++] = near;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i)
      offer(order_[node.first + i]);
  }
  best.distance_m = std::sqrt(best_square);
  return best;
}

bool SurfaceBody::is_inside(const glm::dvec3& p_m) const {
  if (!has_inside_ || square_distance(box(), p_m) > 0.0) return false;
  constexpr std::array directions{glm::dvec3(0.2673, 0.5345, 0.8018), glm::dvec3(-0.6312, 0.7071, -0.3187),
                                  glm::dvec3(0.7713, -0.1291, -0.6233), glm::dvec3(-0.4119, -0.7817, 0.4683)};
  std::array<std::uint32_t, 64> pending{};
  for (const glm::dvec3& direction : directions) {
    const glm::dvec3 inverse = 1.0 / direction;
    int winding = 0;
    bool is_decided = true;
    std::size_t count = 1;
    pending[0] = 0;
    while (count > 0 && is_decided) {
      const Node& node = nodes_[pending[--count]];
      if (!ray_meets(node.box, p_m, inverse)) continue;
      if (node.count == 0) {
        pending[count++] = node.first + 1;
        pending[count++] = node.first;
        continue;
      }
      for (std::uint32_t i = 0; i < node.count; ++i) {
        const auto sign = crossing_sign(triangles_[order_[node.first + i]], p_m, direction);
        is_decided = is_decided && sign.has_value();
        winding += sign.value_or(0);
      }
    }
    if (is_decided) return winding != 0;
  }
  return winds_by_solid_angles(triangles_, p_m);
}

std::vector<glm::dvec3> SurfaceBody::component_points() const {
  std::vector<std::uint32_t> parent(triangles_.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i)
      i = parent[i] = parent[parent[i]];
    return i;
  };
  std::map<std::array<double, 3>, std::uint32_t> at_corner;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    for (const glm::dvec3& c : triangles_[i]) {
      const auto [place, is_new] = at_corner.try_emplace({c.x, c.y, c.z}, i);
      if (!is_new) parent[root(i)] = root(place->second);
    }
  }
  std::vector<glm::dvec3> points;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i)
    if (root(i) == i) points.push_back((triangles_[i][0] + triangles_[i][1] + triangles_[i][2]) / 3.0);
  return points;
}

}  // namespace rtstdb::oracle
