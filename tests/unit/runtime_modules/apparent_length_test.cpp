// The closed form of the paper's Figure 8 against cases that are computed by hand.

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
/// to the right); its middle is straight ahead at `middle_s`.
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

/// Far away the beam's foot moves across the body at v_scan = distance * angular rate and passes it in
/// L / (v_scan -+ v): the apparent length is L v_scan / (v_scan -+ v) = L / (1 -+ v / v_scan).
TEST(ApparentLength, OfAFarBodyIsTheRatioOfSpeeds) {
  const double distance_m = 4000.0;
  for (const bool left_to_right : {true, false}) {
    const ScanPattern pattern = pattern_of(left_to_right);
    const double scan_mps = distance_m * 140.0 * degree;
    for (const double share : {-0.3, -0.05, 0.05, 0.3, 0.6}) {
      // With the beam: to the right when the beam turns to the right.
      const double speed_mps = (left_to_right ? -1.0 : 1.0) * share * scan_mps;
      const auto length = crossing_length(pattern, distance_m, speed_mps);
      ASSERT_TRUE(length);
      EXPECT_NEAR(*length, length_m / (1.0 - share), 1e-4 * length_m) << share << " " << left_to_right;
    }
  }
}

/// The same for a near body: the two instants at which the beam meets its ends, tan(azimuth) = y / distance.
TEST(ApparentLength, OfANearBodyFollowsFromTheTwoMeetings) {
  const double distance_m = 10.0;
  for (const bool left_to_right : {true, false}) {
    for (const double with_beam_mps : {-14.0, -9.0, 2.0, 9.0}) {
      SCOPED_TRACE(with_beam_mps);
      const double side = left_to_right ? -1.0 : 1.0;  // of y, to which the beam turns
      const auto length = crossing_length(pattern_of(left_to_right), distance_m, side * with_beam_mps);
      ASSERT_TRUE(length);
      // Along the beam's turn: fixed point of t, the instant at which the beam is where the end is.
      const auto meets_s = [&](double end_m) {
        double t_s = 0.5;
        for (int i = 0; i < 200; ++i)
          t_s = 0.5 + std::atan2(end_m + with_beam_mps * (t_s - 0.5), distance_m) / (140.0 * degree);
        return t_s;
      };
      const double first_s = meets_s(-0.5 * length_m);
      const double last_s = meets_s(0.5 * length_m);
      EXPECT_NEAR(*length, length_m + with_beam_mps * (last_s - first_s), 1e-9);
    }
  }
}

/// A common motion of sensor and body, and a common rotation, change nothing.
TEST(ApparentLength, DependsOnTheRelativeMotionOnly) {
  const ScanPattern pattern = pattern_of(true);
  const MovingPoint front{{12.0, -2.0}, {1.0, -8.0}};
  const MovingPoint rear{{12.5, 2.5}, {1.0, -8.0}};
  const auto length = apparent_length_m(pattern, {}, front, rear);
  const double heading_rad = 1.1;
  const glm::dvec2 common_mps(7.0, -3.0);
  const auto moved = [&](const MovingPoint& point) {
    const auto rotated = [&](const glm::dvec2& v) {
      return glm::dvec2(std::cos(heading_rad) * v.x - std::sin(heading_rad) * v.y,
                        std::sin(heading_rad) * v.x + std::cos(heading_rad) * v.y);
    };
    return MovingPoint{rotated(point.p_m) + glm::dvec2(100.0, 50.0), rotated(point.v_mps) + common_mps};
  };
  const auto in_motion = apparent_length_m(
      pattern, {.point = {{100.0, 50.0}, common_mps}, .heading_rad = heading_rad}, moved(front), moved(rear));
  ASSERT_TRUE(length && in_motion);
  EXPECT_NEAR(*length, *in_motion, 1e-9);
}

TEST(MeetingTime, FollowsTheAzimuthWithinTheFieldOfView) {
  for (const double azimuth_deg : {-120.0, -71.0, -69.0, -30.0, 0.0, 45.0, 69.0, 71.0, 120.0, 179.0}) {
    SCOPED_TRACE(azimuth_deg);
    const double a = azimuth_deg * degree;
    const auto meets = meeting_time_s(pattern_of(true), {}, {{20.0 * std::cos(a), 20.0 * std::sin(a)}, {}});
    ASSERT_EQ(meets.has_value(), std::abs(azimuth_deg) < 70.0);
    if (meets) {
      EXPECT_NEAR(*meets, 0.5 - azimuth_deg / 140.0, 1e-9);
    }
  }
}

TEST(MeetingTime, IsEmptyForAPointThatTheBeamNeverReaches) {
  // Enters the field of view on the right while the beam is on the left, and leaves before the beam arrives.
  EXPECT_FALSE(meeting_time_s(pattern_of(true), {}, {{1.0, -2.0}, {0.0, -100.0}}));
  // Behind the sensor the azimuth jumps from pi to -pi.
  for (const bool left_to_right : {true, false}) {
    EXPECT_FALSE(meeting_time_s(pattern_of(left_to_right), {}, {{-10.0, 5.0}, {0.0, -10.0}}));
    EXPECT_FALSE(meeting_time_s(pattern_of(left_to_right), {}, {{-10.0, -5.0}, {0.0, 10.0}}));
  }
}

TEST(ApparentLength, IsEmptyWhenTheBeamMissesAnEdge) {
  const ScanPattern pattern = pattern_of(true, 20.0);
  EXPECT_TRUE(crossing_length(pattern, 20.0, 1.0));
  EXPECT_FALSE(crossing_length(pattern, 10.0, 0.0));  // wider than the field of view
  // One end is outside of the field of view all the time.
  EXPECT_FALSE(apparent_length_m(pattern, {}, {{20.0, 5.0}, {}}, {{20.0, 0.5}, {}}));
  EXPECT_FALSE(apparent_length_m(pattern, {}, {{20.0, 0.5}, {}}, {{20.0, 5.0}, {}}));
}

}  // namespace
}  // namespace hil::modules
