// Frusta compared with closed forms and with random points.

#include "rtstdb/oracle/frustum.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace rtstdb::oracle {
namespace {

Frustum straight_ahead(double near_m) {
  return {.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          .near_m = near_m,
          .far_m = 10.0,
          .half_width_m = 10.0,
          .half_height_m = 5.0};
}

OrientedBox cube_at(const glm::dvec3& center_m) {
  OrientedBox box;
  box.center_m = center_m;
  box.half_extent_m = glm::dvec3(1.0);
  return box;
}

TEST(Frustum, SeparationOfABoxFromItsFaces) {
  EXPECT_DOUBLE_EQ(separation_m(straight_ahead(0.0), cube_at({13, 0, 0})), 2.0);
  EXPECT_DOUBLE_EQ(separation_m(straight_ahead(5.0), cube_at({2, 0, 0})), 2.0);
  EXPECT_DOUBLE_EQ(separation_m(straight_ahead(0.0), cube_at({-3, 0, 0})), 2.0);
  // The left face is y = x; the box's corner at (6, 9) lies 3 / sqrt(2) before it.
  EXPECT_NEAR(separation_m(straight_ahead(0.0), cube_at({5, 10, 0})), 3.0 / std::sqrt(2.0), 1e-12);
  EXPECT_LT(separation_m(straight_ahead(0.0), cube_at({5, 5, 0})), 0.0);
}

TEST(Frustum, DepthOfABoxOutside) {
  EXPECT_NEAR(sticks_out_m(cube_at({10, 0, 0}), straight_ahead(0.0)), 1.0, 1e-12);
  EXPECT_NEAR(sticks_out_m(cube_at({5, 0, 0}), straight_ahead(5.0)), 1.0, 1e-12);
  // The corner at (4, 6) lies 2 / sqrt(2) beyond y = x.
  EXPECT_NEAR(sticks_out_m(cube_at({5, 5, 0}), straight_ahead(0.0)), std::sqrt(2.0), 1e-12);
  EXPECT_LT(sticks_out_m(cube_at({8, 0, 0}), straight_ahead(0.0)), 0.0);
}

/// A common point proves contact; a point of the box outside of the frustum proves that the box is not
/// inside.
TEST(Frustum, AgreesWithRandomPoints) {
  std::mt19937_64 engine(91);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&] { return glm::dvec3(unit(engine), unit(engine), unit(engine)); };
  int common = 0;
  int apart = 0;
  int within = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto axes = [&](glm::dvec3(&axis)[3]) {
      const glm::dmat3 turned = glm::mat3_cast(glm::normalize(glm::dquat(unit(engine), vector())));
      for (int i = 0; i < 3; ++i)
        axis[i] = turned[i];
    };
    Frustum frustum{.eye_m = vector(),
                    .near_m = 1.0 + unit(engine),
                    .far_m = 3.0 + unit(engine),
                    .half_width_m = 2.0 + unit(engine),
                    .half_height_m = 2.0 + unit(engine)};
    axes(frustum.axis);
    OrientedBox box;
    axes(box.axis);
    box.center_m = frustum.eye_m + 2.0 * frustum.axis[0] + 3.0 * vector();
    box.half_extent_m = 0.3 + 0.25 * vector();
    const double gap_m = separation_m(frustum, box);
    const double out_m = sticks_out_m(box, frustum);
    for (int k = 0; k < 200; ++k) {
      const glm::dvec3 at = box.half_extent_m * vector();
      const glm::dvec3 p =
          box.center_m + at.x * box.axis[0] + at.y * box.axis[1] + at.z * box.axis[2] - frustum.eye_m;
      const double ahead_m = glm::dot(p, frustum.axis[0]);
      const bool seen =
          ahead_m >= frustum.near_m && ahead_m <= frustum.far_m &&
          std::abs(glm::dot(p, frustum.axis[1])) <= ahead_m * frustum.half_width_m / frustum.far_m &&
          std::abs(glm::dot(p, frustum.axis[2])) <= ahead_m * frustum.half_height_m / frustum.far_m;
      EXPECT_FALSE(seen && gap_m > 1e-9);
      EXPECT_FALSE(!seen && out_m < -1e-9);
      common += seen ? 1 : 0;
    }
    apart += gap_m > 0.0 ? 1 : 0;
    within += out_m <= 0.0 ? 1 : 0;
  }
  EXPECT_GT(common, 10'000);
  EXPECT_GT(apart, 100);
  EXPECT_GT(within, 20);
}

}  // namespace
}  // namespace rtstdb::oracle
