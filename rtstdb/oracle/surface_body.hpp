#pragma once
// The surface of an entity at an instant, with a tree of boxes, for contacts of bodies that do not consist of
// convex parts. Relative to a point of the world, world axes, metres. Internal to the oracle. Constant after
// its creation: any thread.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "rtstdb/oracle/posed_ray.hpp"

namespace rtstdb::oracle {

using SurfaceTriangle = std::array<glm::dvec3, 3>;

struct SurfaceBox {
  glm::dvec3 minimum_m{std::numeric_limits<double>::infinity()};
  glm::dvec3 maximum_m{-std::numeric_limits<double>::infinity()};

  void add(const glm::dvec3& p_m) noexcept;
};

/// A point of a surface.
struct SurfacePoint {
  double distance_m = std::numeric_limits<double>::infinity();  ///< from the point in question, not negative
  glm::dvec3 p_m{0.0};
  std::uint32_t triangle = 0;
};

class SurfaceBody {
 public:
  struct Node {
    SurfaceBox box;
    std::uint32_t first = 0;  ///< leaf: first index in `order`; inner: the left child, before the right one
    std::uint32_t count = 0;  ///< leaf: number of triangles; inner: 0
  };

  /// `has_inside`: the geometry is closed.
  SurfaceBody(const PosedEntity& entity, bool has_inside, const glm::dvec3& origin_m);

  /// By their index in the geometry.
  std::span<const SurfaceTriangle> triangles() const noexcept { return triangles_; }
  std::span<const Node> nodes() const noexcept { return nodes_; }
  std::span<const std::uint32_t> order() const noexcept { return order_; }
  const SurfaceBox& box() const noexcept { return nodes_.front().box; }
  bool has_inside() const noexcept { return has_inside_; }
  double diagonal_m() const noexcept { return diagonal_m_; }  ///< of the scaled bounds
  double largest_coordinate_m() const noexcept { return largest_coordinate_m_; }

  /// The nearest point of the surface. `hint`: a triangle that may be near.
  SurfacePoint nearest(const glm::dvec3& p_m, std::uint32_t hint = 0) const;
  /// Whether the surface winds around the point; false without an inside. The winding number is the sum of
  /// the signs of the triangles that a ray from the point crosses. A ray that comes too close to an edge is
  /// replaced by another one, and after some of them by the sum of solid angles.
  bool is_inside(const glm::dvec3& p_m) const;
  /// A point of each set of triangles that are connected by the positions of their corners.
  std::vector<glm::dvec3> component_points() const;

 private:
  void build(std::uint32_t node, std::uint32_t first, std::uint32_t count,
             const std::vector<glm::dvec3>& centers);

  std::vector<SurfaceTriangle> triangles_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  bool has_inside_ = false;
  double diagonal_m_ = 0.0, largest_coordinate_m_ = 0.0;
};

}  // namespace rtstdb::oracle
