#include "rtstdb/geometry/octahedron.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <rtstdb/srgb.hpp>

namespace rtstdb {
namespace {

/// Degrees, without the rounding of an arc cosine near 1.
double angle_deg(const glm::vec3& a, const glm::vec3& b) {
  const glm::dvec3 da(a), db(b);
  return std::atan2(glm::length(glm::cross(da, db)), glm::dot(da, db)) * 180.0 / 3.14159265358979;
}

TEST(PackedDirection, IsWithinAHundredthOfADegree) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  double largest = 0.0;
  for (int i = 0; i < 200'000; ++i) {
    const glm::vec3 direction(normal(random), normal(random), i % 8 == 0 ? 0.0f : normal(random));
    largest = std::max(largest, angle_deg(unpacked_direction(packed_direction(direction)), direction));
  }
  EXPECT_LT(largest, 0.01);
  EXPECT_GT(largest, 0.001) << "16 bits can not be better";
}

TEST(PackedDirection, KeepsAxesAndNeverHasTheLowestNumber) {
  for (int k = 0; k < 27; ++k) {
    const glm::vec3 direction(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    const float steps = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
    if (steps == 0.0f) continue;
    const std::uint32_t packed = packed_direction(direction);
    EXPECT_NE(packed & 0xFFFFu, 0x8000u);
    EXPECT_NE(packed >> 16, 0x8000u);
    EXPECT_LT(angle_deg(unpacked_direction(packed), direction), steps == 1.0f ? 1e-12 : 0.004);
  }
}

TEST(PackedDirectionDeathTest, RequiresALength) {
  EXPECT_DEATH(packed_direction(glm::vec3(0.0f)), "the direction is zero or not finite");
}

TEST(Srgb, IsTheInverseOfItsInverse) {
  for (int byte = 0; byte < 256; ++byte)
    EXPECT_NEAR(srgb_from_linear(linear_from_srgb(byte / 255.0)), byte / 255.0, 1e-12);
  EXPECT_DOUBLE_EQ(linear_from_srgb(1.0), 1.0);
  EXPECT_NEAR(linear_from_srgb(0.5), 0.21404114, 1e-8);
  EXPECT_NEAR(linear_from_srgb(0.04045 + 1e-9), linear_from_srgb(0.04045), 1e-7) << "no step";
}

}  // namespace
}  // namespace rtstdb
