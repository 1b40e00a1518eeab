#pragma once
// Compares a vector of an answer with the expected one.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace rtstdb::test {

inline void expect_near(const glm::vec3& a, const glm::dvec3& b, double tolerance) {
  EXPECT_LE(glm::length(glm::dvec3(a) - b), tolerance)
      << a.x << ", " << a.y << ", " << a.z << " instead of " << b.x << ", " << b.y << ", " << b.z;
}

}  // namespace rtstdb::test
