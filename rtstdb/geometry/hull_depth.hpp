#pragma once
// How deep points and triangles lie inside a hull: the distance from a point inside it to its surface, which
// is the least distance to the plane of a triangle.
//
// Threads: const functions from any thread. Construction allocates; time n log n for n triangles.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rtstdb/geometry/hull_triangles.hpp"

namespace rtstdb {

class HullDepth {
 public:
  /// The hull and the points outlive it.
  HullDepth(const HullTriangles& hull, std::span<const glm::vec3> points_m);

  struct Nearest {
    double depth_m = 0.0;
    std::uint32_t triangle = 0;  ///< of the hull
  };
  /// The nearest plane to a point in the hull, or one that is not farther than `enough_m`.
  Nearest nearest(const glm::dvec3& point_m, double enough_m) const;
  /// Among the triangles whose planes are at most larger_m farther from the point than the nearest plane: one
  /// whose normal is nearly the given one, otherwise the one whose normal is nearest to it.
  std::uint32_t nearest_with_normal(const glm::dvec3& point_m, const glm::dvec3& normal,
                                    double larger_m) const;

  /// How deep the deepest point of a triangle in the hull lies, at most; empty: deeper than `allowed_m`.
  std::optional<double> depth_within(const std::array<glm::dvec3, 3>& triangle_m, double allowed_m) const;

 private:
  struct Node {
    glm::dvec3 minimum{0.0}, maximum{0.0};
    std::uint32_t first = 0, end = 0;  // in order_
    std::uint32_t right = 0;           // of an inner node, whose left child follows it
  };
  void build(std::uint32_t first, std::uint32_t end);
  /// Calls visit(triangle) for each triangle of which a point is within `limit_m`, and perhaps for others,
  /// nearest boxes first. The visitor may reduce the limit.
  template <class Visit>
  void walk(const glm::dvec3& point_m, const double& limit_m, Visit&& visit) const;

  const HullTriangles& hull_;
  std::span<const glm::vec3> points_m_;
  std::vector<glm::dvec3> centers_m_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace rtstdb
