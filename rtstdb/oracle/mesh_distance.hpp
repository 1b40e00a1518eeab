#pragma once
// The exact distance from a point to a mesh, and whether the point is inside: the reference for distance
// fields. Frame of the mesh. Constant after construction: any thread.

#include <glm/ext/vector_double3.hpp>

#include "rtstdb/oracle/mesh_tree.hpp"

namespace rtstdb::oracle {

/// The nearest point of a mesh.
struct MeshPoint {
  double distance_m = 0.0;  ///< not negative
  glm::dvec3 point_m{0.0};
  std::uint32_t triangle = 0;
};

class MeshDistance {
 public:
  /// The mesh has passed validate.
  explicit MeshDistance(const TriangleMesh& mesh) : tree_(mesh) {}

  MeshPoint nearest(const glm::dvec3& point_m) const;
  /// By the solid angle of all triangles (Van Oosterom and Strackee 1983). Only for a closed mesh, and not
  /// for a point on its surface.
  bool is_inside(const glm::dvec3& point_m) const;
  const MeshTree& tree() const noexcept { return tree_; }

 private:
  MeshTree tree_;
};

}  // namespace rtstdb::oracle
