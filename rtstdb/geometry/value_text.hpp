#pragma once
// Values in error texts of shapes. Pure functions: any thread.

#include <glm/ext/vector_double3.hpp>

#include <cstdio>
#include <string>

namespace rtstdb {

inline std::string text_of(const glm::dvec3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%g, %g, %g)", p.x, p.y, p.z);
  return text;
}

inline std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g m", value);
  return text;
}

}  // namespace rtstdb
