#pragma once
// A vertex of a first-order distance field: the distance there, and its gradient. 8 bytes, as on the device
// (shaders/shared/field.h).

#include <glm/ext/vector_float3.hpp>

#include <cstdint>

namespace rtstdb::field {

/// `gradient`: a unit vector (rtstdb/geometry/octahedron.hpp).
struct Vertex {
  float distance_m = 0.0f;
  std::uint32_t gradient = 0;
};
static_assert(sizeof(Vertex) == 8);

/// Misuse: a gradient without length.
Vertex make_vertex(float distance_m, const glm::vec3& gradient) noexcept;
/// A unit vector.
glm::vec3 gradient_of(const Vertex& vertex) noexcept;

}  // namespace rtstdb::field
