#pragma once
// The transforms of glTF nodes, in double precision. Internal to the glTF reader.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <string>

#include "rtstdb/geometry/gltf_json.hpp"

namespace rtstdb::gltf {

/// Three rows of a 4 x 4 matrix whose last row is 0, 0, 0, 1.
struct Affine {
  std::array<std::array<double, 4>, 3> rows{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  glm::dvec3 transformed(const glm::dvec3& point) const;
  /// A normal of a transformed surface, by the inverse transpose. Of any length; zero if the transform takes
  /// the surface to a line.
  glm::dvec3 transformed_normal(const glm::dvec3& normal) const;
  /// Whether it reverses the orientation of triangles (negative determinant).
  bool mirrors() const;
};

Affine operator*(const Affine& parent, const Affine& child);

/// The transform from the node's frame to its parent's. Throws std::runtime_error if a matrix, translation,
/// rotation or scale has the wrong number of elements, the last row of a matrix is not 0, 0, 0, 1, or a
/// rotation is not a unit quaternion.
Affine node_to_parent(const Json& node, const std::string& place);

}  // namespace rtstdb::gltf
