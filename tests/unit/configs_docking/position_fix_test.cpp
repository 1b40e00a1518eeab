// The position of the capsule from detected reflectors.

#include "configs/docking/guidance/position_fix.hpp"

#include <gtest/gtest.h>

#include <random>

#include "seen_reflectors.hpp"

namespace hil::docking::guidance {
namespace {

const glm::dvec3 mount(-1.2, 0.0, 0.0);

Scanner scanner_of(const test::Beams& beams) {
  return {.mount_body_m = mount, .beam_half_angle_rad = 0.5 * std::sqrt(2.0) * beams.pitch_rad()};
}

TEST(PositionFix, IsWithinABeamAtEveryDistance) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> one(-1.0, 1.0);
  const test::Beams beams;
  int fixes = 0;
  for (const double distance_m : {1.5, 3.0, 6.0, 12.0, 25.0, 45.0}) {
    for (int i = 0; i < 50; ++i) {
      const glm::dvec3 port(0.1 * distance_m * one(random), distance_m, 0.1 * distance_m * one(random));
      const glm::dquat attitude =
          test::facing_the_port({0.04 * one(random), 0.04 * one(random), 0.04 * one(random)});
      const auto detections = test::seen_reflectors(port, attitude, mount, beams);
      if (detections.size() < 3) continue;
      ++fixes;
      const auto fix = find_position(detections, attitude, scanner_of(beams));
      ASSERT_TRUE(fix) << distance_m << " m";
      // A beam is this wide there.
      const double beam_m = beams.pitch_rad() * (distance_m + 1.2);
      EXPECT_LT(glm::length(fix->p_station_m - port), 0.75 * beam_m + 0.02) << distance_m << " m";
      EXPECT_NEAR(fix->p_station_m.y, distance_m, 0.2 * beam_m + 0.05) << distance_m << " m";
    }
  }
  EXPECT_GT(fixes, 250);
}

TEST(PositionFix, PatternIsRecognisedAmongOtherReflections) {
  const glm::dvec3 port(0.3, 8.0, -0.2);
  const glm::dquat attitude = test::facing_the_port();
  const test::Beams fine{.count = 500};
  auto detections = test::seen_reflectors(port, attitude, mount, fine);
  ASSERT_EQ(detections.size(), 8U);
  detections[1] = {.azimuth_rad = 0.25, .elevation_rad = 0.1, .range_m = 12.0};
  detections[4] = {.azimuth_rad = -0.1, .elevation_rad = -0.2, .range_m = 7.0};
  const auto fix = find_position(detections, attitude, scanner_of(fine));
  ASSERT_TRUE(fix);
  EXPECT_EQ(fix->detections, 6U);
  EXPECT_EQ(fix->reflectors, 6U);
  EXPECT_LT(glm::length(fix->p_station_m - port), 0.02);
}

TEST(PositionFix, OneDetectionIsEnoughNearTheExpectedPosition) {
  const glm::dvec3 port(0.02, 0.9, 0.01);
  const glm::dquat attitude = test::facing_the_port();
  const test::Beams fine{.count = 300};
  auto detections = test::seen_reflectors({0.0, 3.0, 0.0}, attitude, mount, fine);
  detections = test::seen_reflectors(port, attitude, mount, {.field_rad = 1.2, .count = 500});
  ASSERT_FALSE(detections.empty());
  detections.resize(1);
  const auto near =
      find_position(detections, attitude, scanner_of(fine), port + glm::dvec3(0.05, 0.0, 0.0), 0.2);
  ASSERT_TRUE(near);
  EXPECT_LT(glm::length(near->p_station_m - port), 0.02);
  EXPECT_FALSE(find_position(detections, attitude, scanner_of(fine), port + glm::dvec3(0.0, 5.0, 0.0), 0.2));
}

TEST(PositionFix, NothingIsFoundInNothing) {
  EXPECT_FALSE(find_position({}, test::facing_the_port(), scanner_of({})));
}

}  // namespace
}  // namespace hil::docking::guidance
