#pragma once
// Whether a mesh bounds a body, so that a point lies inside or outside of it.

#include <span>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

/// Triangles run along every edge, told apart by the places of its ends, as often in one direction as in the
/// other. In one pass and without memory: each edge adds or takes away a 64-bit hash of its ends, by its
/// direction, and an open mesh passes for closed with a chance of one in 2^60. Any thread.
bool is_closed(const MeshView& mesh) noexcept;

/// The same with edges told apart by the numbers of their ends: then the mesh is closed wherever its corners are.
bool is_closed_anywhere(std::span<const glm::uvec3> triangles) noexcept;

}  // namespace rtstdb
