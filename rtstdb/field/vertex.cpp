#include "rtstdb/field/vertex.hpp"

#include "rtstdb/geometry/octahedron.hpp"

namespace rtstdb::field {

Vertex make_vertex(float distance_m, const glm::vec3& gradient) noexcept {
  return {distance_m, packed_direction(gradient)};
}

glm::vec3 gradient_of(const Vertex& vertex) noexcept {
  return unpacked_direction(vertex.gradient);
}

}  // namespace rtstdb::field
