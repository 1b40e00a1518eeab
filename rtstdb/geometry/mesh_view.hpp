#pragma once
// A view of a mesh with separate positions and triangles, since a deforming mesh has many sets of positions
// for the same triangles.

#include <span>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

struct MeshView {
  MeshView(std::span<const glm::vec3> positions, std::span<const glm::uvec3> corners)
      : positions_m(positions), triangles(corners) {}
  MeshView(const TriangleMesh& mesh)  // NOLINT(google-explicit-constructor): a view of a mesh
      : positions_m(mesh.positions_m), triangles(mesh.triangles) {}

  std::span<const glm::vec3> positions_m;
  std::span<const glm::uvec3> triangles;
};

}  // namespace rtstdb
