#pragma once
// Whether an upright box touches a triangle: what a peer needs that knows boxes alone.

#include <array>
#include <span>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace hil::bench {

using Corners = std::array<glm::vec3, 3>;

/// In the mesh's order.
std::vector<Corners> triangles_of(const rtstdb::TriangleMesh& mesh);
std::vector<rtstdb::Bounds> boxes_around(std::span<const Corners> triangles);

/// Separating axes, the cheap ones first, and out at the first that separates. Touching counts.
bool touches(const rtstdb::Bounds& box, const Corners& triangle);

}  // namespace hil::bench
