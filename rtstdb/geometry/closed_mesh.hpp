#pragma once
// Whether a mesh is closed, so that a point is inside or outside.

#include <glm/ext/vector_uint2.hpp>

#include <vector>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

/// Whether, along every edge, as many triangles run in one direction as in the other. Edges are compared by
/// the positions of their ends. One pass without memory: each edge adds or subtracts a 64-bit hash of its
/// ends, depending on its direction; an open mesh passes for closed with a probability of 2^-60. Any thread.
bool is_closed(const MeshView& mesh) noexcept;

/// Decides whether a deforming mesh is closed in each of its shapes. As long as positions that coincided at
/// construction still coincide, the edges that were paired remain paired, and only the unpaired ones are
/// examined.
class ClosedShapes {
 public:
  ClosedShapes() = default;
  /// Allocates and sorts all edges.
  explicit ClosedShapes(const MeshView& mesh);

  /// The same result as rtstdb::is_closed. `mesh` must have the triangles given to the constructor. Any
  /// thread.
  bool is_closed(const MeshView& mesh) const noexcept;

 private:
  std::vector<glm::uvec2> together_;  // pairs of coinciding positions
  std::vector<glm::uvec2> unpaired_;  // directed edges x to y without a partner, repeated by their excess
};

}  // namespace rtstdb
