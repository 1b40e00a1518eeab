#pragma once
// A geometry with a binary tree of boxes over its triangles, in double precision. Conservative: a walk visits
// every triangle that a box or ray may touch, or that may be near enough. Constant after its creation: any
// thread.

#include <glm/common.hpp>
#include <glm/ext/vector_double3.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace rtstdb::oracle {

/// A ray in the frame of a mesh; lambda as in the world.
struct LocalRay {
  glm::dvec3 origin{0.0};
  glm::dvec3 direction{0.0};
  double lambda_min = 0.0;
  double lambda_max = 0.0;
};

class MeshTree {
 public:
  /// The mesh has passed validate.
  explicit MeshTree(const TriangleMesh& mesh);

  const Bounds& bounds() const noexcept { return bounds_; }
  std::uint32_t triangle_count() const noexcept { return static_cast<std::uint32_t>(mesh_.triangles.size()); }
  std::array<glm::dvec3, 3> corners(std::uint32_t triangle) const noexcept;
  /// Whether distances have a sign, see NearestQueryOptions.
  bool closed() const noexcept { return closed_; }
  /// Result of is_convex for the mesh (oracle.hpp).
  bool convex() const noexcept { return convex_; }
  /// Whether the mesh is closed with its fronts inside: its signed volume is negative.
  bool inside_out() const noexcept { return inside_out_; }

  /// Whether a corner is more than `limit` in front of the plane through the point.
  bool has_corner_beyond(const glm::dvec3& point, const glm::dvec3& normal, double limit) const;

  /// Calls visit(triangle) for every triangle whose box, enlarged by `grow` per axis, the ray meets within
  /// its range, and perhaps for others. The visitor may reduce ray.lambda_max.
  template <class Visit>
  void walk(LocalRay& ray, const glm::dvec3& grow, Visit&& visit) const;

  /// Calls visit(triangle) for every triangle within `limit` of the point, and perhaps for others. Point and
  /// distance are those of the mesh scaled by `scale`. The visitor may reduce the limit.
  template <class Visit>
  void walk_near(const glm::dvec3& point, const glm::dvec3& scale, const double& limit, Visit&& visit) const;

 private:
  struct Node {
    glm::dvec3 minimum, maximum;
    std::uint32_t first = 0;  ///< leaf: first index in order_; inner: the left child
    std::uint32_t count =
        0;  ///< leaf: number of triangles; inner: 0, and the right child follows the left one
  };

  void build(std::uint32_t node, std::uint32_t first, std::uint32_t count,
             const std::vector<glm::dvec3>& centers);
  /// Whether every point of the closed surface is within the tolerance (convex_tolerance, hull_tolerance_ulp)
  /// of the surface of the hull of its corners, and the surface covers that of the hull (convexity.cpp).
  bool is_convex_surface() const;
  static bool meets(const Node& node, const LocalRay& ray, const glm::dvec3& grow) noexcept;
  static double distance(const Node& node, const glm::dvec3& point, const glm::dvec3& scale) noexcept;

  TriangleMesh mesh_;
  Bounds bounds_;
  double magnitude_ = 0.0;  ///< largest coordinate
  bool closed_ = false;
  bool convex_ = false;
  bool inside_out_ = false;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

template <class Visit>
void MeshTree::walk(LocalRay& ray, const glm::dvec3& grow, Visit&& visit) const {
  // Bounds the difference of rounding between the box test and a triangle test.
  const glm::dvec3 size = glm::abs(ray.origin);
  const glm::dvec3 grown = grow + 1e-12 * (magnitude_ + std::max({size.x, size.y, size.z}));
  std::vector<std::uint32_t> pending{0};
  while (!pending.empty()) {
    const Node& node = nodes_[pending.back()];
    pending.pop_back();
    if (!meets(node, ray, grown)) continue;
    if (node.count == 0) {
      pending.push_back(node.first + 1);
      pending.push_back(node.first);
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i)
      visit(order_[node.first + i]);
  }
}

template <class Visit>
void MeshTree::walk_near(const glm::dvec3& point, const glm::dvec3& scale, const double& limit,
                         Visit&& visit) const {
  // The nearer child first; the other one is tested again when it is popped.
  std::vector<std::pair<double, std::uint32_t>> pending{{distance(nodes_[0], point, scale), 0}};
  while (!pending.empty()) {
    const auto [node_distance, index] = pending.back();
    pending.pop_back();
    // Bounds the difference of rounding between the box test and the distance to a triangle.
    if (node_distance > limit + 1e-12 * (limit + magnitude_ * std::max({scale.x, scale.y, scale.z})))
      continue;
    const Node& node = nodes_[index];
    if (node.count == 0) {
      std::pair<double, std::uint32_t> near{distance(nodes_[node.first], point, scale), node.first};
      std::pair<double, std::uint32_t> far{distance(nodes_[node.first + 1], point, scale), node.first + 1};
      if (far < near) std::swap(near, far);
      pending.push_back(far);
      pending.push_back(near);
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i)
      visit(order_[node.first + i]);
  }
}

}  // namespace rtstdb::oracle
