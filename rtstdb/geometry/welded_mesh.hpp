#pragma once
// A mesh whose corners are compared by place, not by index.
//
// Pure functions: any thread. They allocate.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <array>
#include <cstdint>
#include <vector>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

/// Without positions that no triangle uses, and without triangles that have no area.
struct WeldedMesh {
  std::vector<glm::vec3> points_m;
  std::vector<glm::uvec3> triangles;   ///< indices of points; with an area
  std::vector<std::uint32_t> numbers;  ///< of these in the mesh
  double diagonal_m = 0.0;             ///< of the mesh's box

  glm::dvec3 at(std::uint32_t point) const { return glm::dvec3(points_m[point]); }
  std::array<glm::dvec3, 3> corners(const glm::uvec3& t) const { return {at(t.x), at(t.y), at(t.z)}; }
};

WeldedMesh welded(const MeshView& mesh);

/// Leaves the first of triangles with the same corners in the same order.
void remove_repeated(WeldedMesh& mesh);

}  // namespace rtstdb
