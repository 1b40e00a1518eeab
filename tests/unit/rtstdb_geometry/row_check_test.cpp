#include "rtstdb/geometry/row_check.hpp"

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <rtstdb/limits.hpp>

namespace rtstdb {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

EntityRow good_row() {
  EntityRow row;
  row.geometry = {3};
  row.motion.p_world_m = {1.0, 2.0, 3.0};
  return row;
}

void expect_refused(const EntityRow& row, BadInputReason reason) {
  const auto bad = check_row(row);
  ASSERT_TRUE(bad.has_value());
  EXPECT_EQ(bad->reason, reason);
}

TEST(CheckRow, AcceptsRowsUpToTheLimits) {
  EntityRow row = good_row();
  EXPECT_FALSE(check_row(row));
  row.motion.p_world_m = {max_coordinate_m, -max_coordinate_m, max_coordinate_m};
  row.motion.v_world_mps = {0.0, -max_speed_mps, 0.0};
  row.motion.w_world_radps = {0.0, 0.0, max_angular_rate_radps};
  row.scale = {min_scale, 1.0, max_scale};
  row.motion.q_world = {-3.0, 4.0, 0.0, 1e-9};
  EXPECT_FALSE(check_row(row));
}

TEST(CheckRow, RefusesEachComponentThatIsNotFinite) {
  for (const double value : {nan, infinity, -infinity}) {
    for (int i = 0; i < 3; ++i) {
      EntityRow row = good_row();
      row.motion.p_world_m[i] = value;
      expect_refused(row, BadInputReason::not_finite);
      row = good_row();
      row.motion.v_world_mps[i] = value;
      expect_refused(row, BadInputReason::not_finite);
      row = good_row();
      row.motion.w_world_radps[i] = value;
      expect_refused(row, BadInputReason::not_finite);
      row = good_row();
      row.scale[i] = value;
      expect_refused(row, BadInputReason::not_finite);
    }
    for (int i = 0; i < 4; ++i) {
      EntityRow row = good_row();
      row.motion.q_world[i] = value;
      expect_refused(row, BadInputReason::not_finite);
    }
  }
}

TEST(CheckRow, ReturnsTheValues) {
  EntityRow row = good_row();
  row.motion.p_world_m = {1.0, nan, -7.0};
  auto bad = check_row(row);
  ASSERT_TRUE(bad);
  EXPECT_EQ(bad->values[0], 1.0);
  EXPECT_TRUE(std::isnan(bad->values[1]));
  EXPECT_EQ(bad->values[2], -7.0);
  EXPECT_EQ(bad->values[3], 0.0);

  row = good_row();
  row.motion.q_world = {1.0, 2.0, 3.0, infinity};
  bad = check_row(row);
  ASSERT_TRUE(bad);
  EXPECT_EQ(bad->values[0], 1.0);
  EXPECT_EQ(bad->values[1], 2.0);
  EXPECT_EQ(bad->values[2], 3.0);
  EXPECT_EQ(bad->values[3], infinity);
}

TEST(CheckRow, RefusesZeroQuaternions) {
  EntityRow row = good_row();
  row.motion.q_world = {0.0, 0.0, 0.0, 0.0};
  expect_refused(row, BadInputReason::zero_quaternion);
  row.motion.q_world = {-0.0, 0.0, 5e-324, 0.0};
  expect_refused(row, BadInputReason::zero_quaternion);
}

TEST(CheckRow, RefusesValuesJustBeyondALimit) {
  const auto beyond = [](double limit) { return std::nextafter(limit, infinity); };
  for (const double scale : {beyond(max_scale), std::nextafter(min_scale, 0.0), 0.0, -1.0}) {
    SCOPED_TRACE(scale);
    EntityRow row = good_row();
    row.scale.y = scale;
    expect_refused(row, BadInputReason::out_of_limits);
  }
  EntityRow row = good_row();
  row.motion.p_world_m.z = -beyond(max_coordinate_m);
  expect_refused(row, BadInputReason::out_of_limits);
  row = good_row();
  row.motion.v_world_mps.x = beyond(max_speed_mps);
  expect_refused(row, BadInputReason::out_of_limits);
  row = good_row();
  row.motion.w_world_radps.y = -beyond(max_angular_rate_radps);
  expect_refused(row, BadInputReason::out_of_limits);
}

TEST(CheckRow, LimitsTheLengthOfVelocities) {
  EntityRow row = good_row();
  row.motion.v_world_mps = glm::dvec3(0.6 * max_speed_mps);
  expect_refused(row, BadInputReason::out_of_limits);
  row = good_row();
  row.motion.w_world_radps = glm::dvec3(0.6 * max_angular_rate_radps);
  expect_refused(row, BadInputReason::out_of_limits);
  row.motion.w_world_radps = glm::dvec3(std::numeric_limits<double>::max());
  expect_refused(row, BadInputReason::out_of_limits);
}

TEST(CheckRow, AcceptsARowWithoutGeometry) {
  EntityRow row = good_row();
  row.geometry = {};
  EXPECT_FALSE(check_row(row)) << "such an entity is not hit, but may be a carrier";
}

TEST(Normalised, HasUnitLengthForEachMagnitude) {
  for (const double magnitude : {3e-308, 1e-200, 1e-20, 0.5, 1.0, 7.0, 1e20, 1e200, 1.7e308}) {
    EntityRow row = good_row();
    row.motion.q_world = glm::dquat(0.5, -0.5, 0.5, 1.0) * magnitude;
    if (!std::isfinite(row.motion.q_world.z)) row.motion.q_world.z = magnitude;
    ASSERT_FALSE(check_row(row)) << magnitude;
    const glm::dquat q = normalised(row).motion.q_world;
    EXPECT_NEAR(glm::dot(q, q), 1.0, 1e-15) << magnitude;
    EXPECT_NEAR(q.z / q.w, 2.0, 1e-12) << magnitude;
    EXPECT_LT(q.x, 0.0);
  }
}

TEST(Normalised, ChangesNothingElse) {
  EntityRow row = good_row();
  row.motion.q_world = {2.0, 0.0, 0.0, 0.0};
  row.motion.v_world_mps = {1.0, 2.0, 3.0};
  row.motion.w_world_radps = {4.0, 5.0, 6.0};
  row.motion.valid_from = world_time_ns(42);
  row.mask = 5;
  row.material = {6};
  row.scale = {7.0, 8.0, 9.0};
  const EntityRow unit = normalised(row);
  EXPECT_EQ(unit.motion.q_world, glm::dquat(1.0, 0.0, 0.0, 0.0));
  EXPECT_EQ(unit.motion.p_world_m, row.motion.p_world_m);
  EXPECT_EQ(unit.motion.v_world_mps, row.motion.v_world_mps);
  EXPECT_EQ(unit.motion.w_world_radps, row.motion.w_world_radps);
  EXPECT_EQ(unit.motion.valid_from, row.motion.valid_from);
  EXPECT_EQ(unit.geometry, row.geometry);
  EXPECT_EQ(unit.scale, row.scale);
  EXPECT_EQ(unit.mask, row.mask);
  EXPECT_EQ(unit.material, row.material);
}

TEST(NormalisedDeathTest, OfAZeroQuaternionIsMisuse) {
  Motion motion;
  motion.q_world = {0.0, 0.0, 0.0, 0.0};
  EXPECT_DEATH(normalised(motion), "the quaternion is zero or not finite");
}

}  // namespace
}  // namespace rtstdb
