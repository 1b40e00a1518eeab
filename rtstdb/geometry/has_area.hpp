#pragma once
// Whether a triangle has an area in double precision, as in shaders/common/has_area.glsl.

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace rtstdb {

inline bool has_area(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  return glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a)) != glm::dvec3(0.0);
}

}  // namespace rtstdb
