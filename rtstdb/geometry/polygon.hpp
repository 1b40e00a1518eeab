#pragma once
// Cuts a polygon of a mesh file into triangles.

#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace rtstdb {

/// Appends the triangles of a polygon, with its sense of rotation and no new corners: n - 2 triangles for n
/// >= 3 corners, none for fewer. Convex or not, flat or nearly so (seen along its mean normal); one that
/// crosses itself gets some triangles between its corners. Time: n^2 for the usual, n^3 at worst: whoever reads
/// a file refuses more than max_polygon_corners. `corners` index `positions_m`.
void triangulate_polygon(std::span<const glm::vec3> positions_m, std::span<const std::uint32_t> corners,
                         std::vector<glm::uvec3>& triangles);

}  // namespace rtstdb
