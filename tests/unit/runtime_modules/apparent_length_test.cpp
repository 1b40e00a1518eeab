// The closed form of the paper's Figure 8 against cases that can be worked out by hand.

#include "runtime/modules/laser_scanner/apparent_length.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>

namespace hil::modules {
namespace {

constexpr double degree = 3.14159265358979323846 / 180.0;
constexpr double length_m = 4.5;

ScanPattern pattern_of(bool left_to_right, double horizontal_deg = 140.0,
                       std::int64_t period_ns = 1'000'000'000) {
  return ScanPattern({.columns = 480,
                      .rows = 1,
                      .horizontal_rad = horizontal_deg * degree,
                      .vertical_rad = 0.1,
                      .elevation_rad = 0.0,
                      .period_ns = period_ns,
                      .left_to_right = left_to_right});
}

/// A body across the line of sight, `distance_m` ahead, driving to the left (+y) with `speed_mps` (negative:
/// to the right); its middle stands straight ahead at `middle_s`.
std::optional<double> crossing_length(const ScanPattern& pattern, double distance_m, double speed_mps,
                                      double middle_s = 0.5, const SensorMotion& sensor = {}) {
  const glm::dvec2 travel(0.0, speed_mps < 0.0 ? -1.0 : 1.0);
  const glm::dvec2 v(0.0, speed_mps);
  const glm::dvec2 middle = glm::dvec2(distance_m, 0.0) - v * middle_s;
  return apparent_length_m(pattern, sensor, {middle + 0.5 * length_m * travel, v},
                           {middle - 0.5 * length_m * travel, v});
}

TEST(ApparentLength, OfAStandingBodyIsItsLength) {
  for (const bool left_to_right : {true, false}) {
    for (const double distance_m : {3.0, 20.0, 200.0}) {
      const auto length = crossing_length(pattern_of(left_to_right), distance_m, 0.0);
      ASSERT_TRUE(length);
      EXPECT_NEAR(*length, length_m, 1e-9);
    }
  }
}

/// Far away the beam's foot moves across the body at v_scan = distance * angular rate, and the two meet after
/// L / (v_scan -+ v): the body seems L v_scan / (v_scan -+ v) = L / (1 -+ v / v_scan) long.
TEST(ApparentLength, OfAFarBodyIsTheRatioOfSpeeds) {
  const double distance_m = 4000.0;
  for (const bool left_to_right : {true, false}) {
    const ScanPattern pattern = pattern_of(left_to_right);
    const double scan_mps = distance_m * 140.0 * degree;
    for (const double share : {-0.3, -0.05, 0.05, 0.3, 0.6}) {
      // With the beam: to the right when it turns to the right.
      const double speed_mps = (left_to_right ? -1.0 : 1.0) * share * scan_mps;
      const auto length = crossing_length(pattern, distance_m, speed_mps);
      ASSERT_TRUE(length);
      EXPECT_NEAR(*length, length_m / (1.0 - share), 1e-4 * length_m) << share << " " << left_to_right;
    }
  }
}

/// The same for a body near by: the two instants by hand, tan(azimuth) = y / distance.
TEST(ApparentLength, OfANearBodyIsGivenByTheTwoMeetings) {
  const ScanPattern pattern = pattern_of(true);
  const double distance_m = 10.0;
  const double speed_mps = 9.0;
  const auto length = crossing_length(pattern, distance_m, -speed_mps);
  ASSERT_TRUE(length);
  const auto meets = [&](double y_at_middle_m) {
    // Fixed point of t: where the edge is at t says when the beam is there.
    double t_s = 0.5;
    for (int i = 0; i < 200; ++i) {
      const double y_m = y_at_middle_m - speed_mps * (t_s - 0.5);
      t_s = 0.5 - std::atan2(y_m, distance_m) / (140.0 * degree);
    }
    return t_s;
  };
  const double front_s = meets(-0.5 * length_m);
  const double rear_s = meets(0.5 * length_m);
  EXPECT_GT(front_s, rear_s);  // the beam overtakes it
  EXPECT_NEAR(*length, length_m + speed_mps * (front_s - rear_s), 1e-9);
  EXPECT_GT(*length, 1.3 * length_m);
}

TEST(ApparentLength, IsTheSameInAMirror) {
  for (const double speed_mps : {-9.0, 9.0, -14.0}) {
    const auto one = crossing_length(pattern_of(true), 12.0, speed_mps);
    const auto mirrored = crossing_length(pattern_of(false), 12.0, -speed_mps);
    ASSERT_TRUE(one && mirrored);
    EXPECT_NEAR(*one, *mirrored, 1e-9);
  }
}

TEST(ApparentLength, GrowsWithTheSpeedAlongTheBeamAndShrinksAgainstIt) {
  const ScanPattern pattern = pattern_of(true);
  double before_m = 0.0;
  for (const double to_the_right_mps : {-12.0, -6.0, 0.0, 6.0, 12.0}) {
    const auto length = crossing_length(pattern, 15.0, -to_the_right_mps);
    ASSERT_TRUE(length);
    EXPECT_GT(*length, before_m);
    before_m = *length;
  }
}

TEST(ApparentLength, DependsOnTheMotionBetweenSensorAndBodyAlone) {
  const ScanPattern pattern = pattern_of(true);
  const glm::dvec2 shared_mps(7.0, -3.0);
  const MovingPoint front{{12.0, -2.0}, {1.0, -8.0}};
  const MovingPoint rear{{12.5, 2.5}, {1.0, -8.0}};
  const auto moved = [&](const MovingPoint& point) {
    return MovingPoint{point.p_m + glm::dvec2(100.0, 50.0), point.v_mps + shared_mps};
  };
  const auto at_rest = apparent_length_m(pattern, {}, front, rear);
  const auto in_motion = apparent_length_m(
      pattern, {.point = {{100.0, 50.0}, shared_mps}, .heading_rad = 0.0}, moved(front), moved(rear));
  ASSERT_TRUE(at_rest && in_motion);
  EXPECT_NEAR(*at_rest, *in_motion, 1e-9);
}

TEST(ApparentLength, TurnsWithTheSensor) {
  const ScanPattern pattern = pattern_of(true);
  const double heading_rad = 1.1;
  const auto turned = [&](const glm::dvec2& v) {
    return glm::dvec2(std::cos(heading_rad) * v.x - std::sin(heading_rad) * v.y,
                      std::sin(heading_rad) * v.x + std::cos(heading_rad) * v.y);
  };
  const MovingPoint front{{12.0, -2.0}, {1.0, -8.0}};
  const MovingPoint rear{{12.5, 2.5}, {1.0, -8.0}};
  const auto straight = apparent_length_m(pattern, {}, front, rear);
  const auto around =
      apparent_length_m(pattern, {.point = {}, .heading_rad = heading_rad},
                        {turned(front.p_m), turned(front.v_mps)}, {turned(rear.p_m), turned(rear.v_mps)});
  ASSERT_TRUE(straight && around);
  EXPECT_NEAR(*straight, *around, 1e-9);
}

TEST(MeetingTime, IsWhereTheBeamLooks) {
  const ScanPattern pattern = pattern_of(true);
  for (const double azimuth_deg : {-69.0, -30.0, 0.0, 45.0, 69.0}) {
    const double a = azimuth_deg * degree;
    const auto meets = meeting_time_s(pattern, {}, {{20.0 * std::cos(a), 20.0 * std::sin(a)}, {}});
    ASSERT_TRUE(meets);
    EXPECT_NEAR(*meets, 0.5 - azimuth_deg / 140.0, 1e-9);
  }
}

TEST(MeetingTime, IsEmptyOutsideOfTheFieldOfView) {
  const ScanPattern pattern = pattern_of(true);
  for (const double azimuth_deg : {-71.0, 71.0, 120.0, -120.0, 179.0}) {
    const double a = azimuth_deg * degree;
    EXPECT_FALSE(meeting_time_s(pattern, {}, {{20.0 * std::cos(a), 20.0 * std::sin(a)}, {}})) << azimuth_deg;
  }
}

TEST(MeetingTime, IsEmptyForAPointThatRunsAwayFromTheBeam) {
  // Enters the field of view on the right as the beam leaves the left, and is out again before it comes.
  const ScanPattern pattern = pattern_of(true);
  EXPECT_FALSE(meeting_time_s(pattern, {}, {{1.0, -2.0}, {0.0, -100.0}}));
}

/// Behind the sensor the azimuth jumps from pi to -pi: no beam is there.
TEST(MeetingTime, IsEmptyForAPointThatPassesBehindTheSensor) {
  for (const bool left_to_right : {true, false}) {
    EXPECT_FALSE(meeting_time_s(pattern_of(left_to_right), {}, {{-10.0, 5.0}, {0.0, -10.0}}));
    EXPECT_FALSE(meeting_time_s(pattern_of(left_to_right), {}, {{-10.0, -5.0}, {0.0, 10.0}}));
  }
}

TEST(ApparentLength, IsEmptyWhenTheBeamMissesAnEdge) {
  const ScanPattern pattern = pattern_of(true, 20.0);
  EXPECT_TRUE(crossing_length(pattern, 20.0, 1.0));
  EXPECT_FALSE(crossing_length(pattern, 10.0, 0.0));  // wider than the field of view
  // The front is out of it all the time, the rear in it.
  EXPECT_FALSE(apparent_length_m(pattern, {}, {{20.0, 5.0}, {}}, {{20.0, 0.5}, {}}));
  EXPECT_FALSE(apparent_length_m(pattern, {}, {{20.0, 0.5}, {}}, {{20.0, 5.0}, {}}));
}

}  // namespace
}  // namespace hil::modules
