#include "rtstdb/field/vertex.hpp"

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <random>

namespace rtstdb::field {
namespace {

TEST(FieldVertex, KeepsTheDistanceAndTheDirection) {
  std::mt19937_64 random(48);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 100'000; ++i) {
    const glm::vec3 gradient = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
    const Vertex vertex = make_vertex(normal(random), gradient);
    const glm::dvec3 kept(gradient_of(vertex));
    EXPECT_EQ(make_vertex(vertex.distance_m, gradient).distance_m, vertex.distance_m);
    ASSERT_LT(glm::length(glm::cross(glm::dvec3(gradient), kept)), 1e-4) << gradient.x << " " << gradient.y;
    ASSERT_GT(glm::dot(glm::dvec3(gradient), kept), 0.0);
  }
}

TEST(FieldVertex, KeepsTheAxes) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0f, 1.0f}) {
      glm::vec3 gradient(0.0f);
      gradient[axis] = side;
      const glm::vec3 kept = gradient_of(make_vertex(2.5f, gradient));
      EXPECT_EQ(kept, gradient) << axis << ", " << side;
    }
  }
}

/// A gradient of any length counts by its direction.
TEST(FieldVertex, NeedsNoUnitGradient) {
  const glm::vec3 gradient(3.0f, -4.0f, 12.0f);
  EXPECT_EQ(make_vertex(1.0f, gradient).gradient, make_vertex(1.0f, gradient / 13.0f).gradient);
}

}  // namespace
}  // namespace rtstdb::field
