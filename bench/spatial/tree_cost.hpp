#pragma once
// What a ray through the box of a tree pays by the surface area heuristic: each node that it is expected to visit costs
// node_cost, each triangle that it is expected to test triangle_cost. A box that lies within another is met by as large a part of
// the rays that meet the other as its surface is of the other's.

#include <glm/common.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstddef>

namespace hil::bench {

inline constexpr double node_cost = 1.0;
inline constexpr double triangle_cost = 0.3;

struct CostBox {
  glm::dvec3 lo{1e300}, hi{-1e300};
  void grow(const CostBox& other) {
    lo = glm::min(lo, other.lo);
    hi = glm::max(hi, other.hi);
  }
  double area() const {
    const glm::dvec3 size = hi - lo;
    return 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
  }
};

/// Added up while a tree is walked. The root is a node too.
class TreeCost {
 public:
  void add_node(const CostBox& box) { sum_ += node_cost * box.area(); }
  void add_leaf(const CostBox& box, std::size_t triangles) {
    sum_ += triangle_cost * static_cast<double>(triangles) * box.area();
  }
  double of_root(const CostBox& root) const { return sum_ / root.area(); }

 private:
  double sum_ = 0.0;
};

}  // namespace hil::bench
