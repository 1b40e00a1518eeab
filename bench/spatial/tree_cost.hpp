#pragma once
// The expected cost of a ray that passes through the box of a tree, by the surface area heuristic: node_cost
// for each expected node visit and triangle_cost for each expected triangle test. The probability that a ray
// through one box meets a box inside it is the ratio of their surfaces.

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

/// Accumulated while a tree is walked. The root counts as a node.
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
