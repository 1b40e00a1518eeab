#pragma once
// Whether a mesh bounds a body, so that a point lies inside or outside of it.

#include <glm/ext/vector_uint2.hpp>

#include <vector>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

/// Triangles run along every edge, told apart by the places of its ends, as often in one direction as in the
/// other. In one pass and without memory: each edge adds or takes away a 64-bit hash of its ends, by its
/// direction, and an open mesh passes for closed with a chance of one in 2^60. Any thread.
bool is_closed(const MeshView& mesh) noexcept;

/// Whether a mesh is closed in each of its shapes: triangles stay, corners move. As long as corners that stood at one
/// place do so again, what its paired edges have to each other stays, and only those are looked at that had no partner.
class ClosedShapes {
 public:
  ClosedShapes() = default;
  /// Takes memory, and the time of a sort of all edges.
  explicit ClosedShapes(const MeshView& mesh);

  /// The same as rtstdb::is_closed; the mesh has the triangles that this was made with. Any thread.
  bool is_closed(const MeshView& mesh) const noexcept;

 private:
  std::vector<glm::uvec2> together_;  // corners at one place
  std::vector<glm::uvec2> unpaired_;  // edges from x to y, as often as they are there too often
};

}  // namespace rtstdb
