#pragma once
// The normals and colours of a glTF primitive's vertices. Internal to the glTF reader.

#include <glm/ext/vector_double3.hpp>

#include <optional>
#include <string>

#include "rtstdb/geometry/gltf_accessors.hpp"

namespace rtstdb::gltf {

class CornerAccessors {
 public:
  CornerAccessors() = default;
  /// NORMAL and COLOR_0 of a primitive's `attributes`. Throws std::exception with the place and the values
  /// for another type than glTF 2.0 allows, another count than that of `positions`, and a value that is not
  /// finite.
  CornerAccessors(Accessors& accessors, const Json& attributes, const Accessor& positions,
                  const std::string& place);

  bool has_normals() const noexcept { return normals_.has_value(); }
  bool has_colors() const noexcept { return colors_.has_value(); }
  /// In the frame of the mesh, as the file has it.
  glm::dvec3 normal(std::uint64_t vertex) const;
  /// Linear, clamped to 0 to 1 as glTF 2.0 requires; without alpha.
  glm::dvec3 color(std::uint64_t vertex) const;

 private:
  std::optional<Accessor> normals_, colors_;
};

}  // namespace rtstdb::gltf
