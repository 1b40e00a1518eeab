#pragma once
// Whether an axis-aligned box touches a triangle, for peers that store boxes only.

#include <array>
#include <span>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace hil::bench {

using Corners = std::array<glm::vec3, 3>;

/// In the mesh's order.
std::vector<Corners> triangles_of(const rtstdb::TriangleMesh& mesh);
std::vector<rtstdb::Bounds> boxes_around(std::span<const Corners> triangles);

/// The separating axis test, cheapest axes first, with an early exit. Touching counts.
bool touches(const rtstdb::Bounds& box, const Corners& triangle);

}  // namespace hil::bench
