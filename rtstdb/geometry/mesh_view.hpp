#pragma once
// A mesh whose corners and triangles may lie apart: one that deforms has many places of corners for the same triangles.

#include <span>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

struct MeshView {
  MeshView(std::span<const glm::vec3> positions, std::span<const glm::uvec3> corners)
      : positions_m(positions), triangles(corners) {}
  MeshView(const TriangleMesh& mesh)  // NOLINT(google-explicit-constructor): a mesh is seen as what it is
      : positions_m(mesh.positions_m), triangles(mesh.triangles) {}

  std::span<const glm::vec3> positions_m;
  std::span<const glm::uvec3> triangles;
};

}  // namespace rtstdb
