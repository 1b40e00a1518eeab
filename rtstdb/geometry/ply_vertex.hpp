#pragma once
// What the properties of a vertex of a PLY file mean: position, normal and colour. Internal to the PLY
// reader.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>

#include <array>
#include <cstdint>
#include <vector>

#include "rtstdb/geometry/ply_header.hpp"

namespace rtstdb::ply {

/// The values that a vertex has of its properties, in the order x, y, z, nx, ny, nz, red, green, blue.
using VertexValues = std::array<double, 9>;

class VertexLayout {
 public:
  /// Throws std::runtime_error if only one or two of nx, ny, nz or of red, green, blue are there, or if a
  /// colour has a type that load_mesh does not read.
  explicit VertexLayout(const Element& element);

  /// The place in VertexValues of the element's property; none: its value is ignored.
  static constexpr std::size_t none = VertexValues{}.size();
  std::size_t place_of(std::size_t property) const { return places_[property]; }

  bool has_normals() const noexcept { return has_normals_; }
  bool has_colors() const noexcept { return has_colors_; }
  glm::dvec3 position(const VertexValues& values) const { return {values[0], values[1], values[2]}; }
  /// Of length 1 or 0. `vertex` is for error texts; throws std::runtime_error for a value that is not finite.
  glm::vec3 normal(const VertexValues& values, std::uint64_t vertex) const;
  /// Linear. Throws std::runtime_error for a value outside the range of its type.
  glm::vec3 color(const VertexValues& values, std::uint64_t vertex) const;

 private:
  std::vector<std::size_t> places_;  ///< by property
  bool has_normals_ = false, has_colors_ = false;
  std::array<double, 3> brightest_{1.0, 1.0, 1.0};  ///< the values of white
};

}  // namespace rtstdb::ply
