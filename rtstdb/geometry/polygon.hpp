#pragma once
// Triangulates a polygon of a mesh file by ear clipping.

#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace rtstdb {

/// Appends the triangles of a polygon, in its orientation and without new corners: n - 2 triangles for n >= 3
/// corners, none for fewer. A triangle names its corners by their places in `corners`. The polygon may be
/// concave, and need not be exactly planar (it is projected along its mean normal). A polygon that intersects
/// itself gets some triangulation of its corners. Time: usually n^2, at worst n^3; readers refuse more than
/// max_polygon_corners. `corners` are indices into `positions_m`.
void triangulate_polygon(std::span<const glm::vec3> positions_m, std::span<const std::uint32_t> corners,
                         std::vector<glm::uvec3>& places);

}  // namespace rtstdb
