// Where a docking port is relative to another one.

#include "configs/docking/modules/docking_port/port_geometry.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hil::modules {
namespace {

using glm::dquat;
using glm::dvec3;

constexpr double pi = std::numbers::pi;
const dvec3 z_axis(0.0, 0.0, 1.0);

TEST(RelativePort, OfTwoBodiesAtRest) {
  // The target's port is 3 m ahead of its origin and looks along its x; the chaser is 10 m in front of it,
  // 2 m aside, and looks back at it, turned by 0.1 rad.
  const rtstdb::Motion target{.p_world_m = {100.0, 0.0, 0.0}};
  const rtstdb::Motion chaser{.p_world_m = {113.0 + 1.5 * std::cos(0.1), 2.0 + 1.5 * std::sin(0.1), 0.0},
                              .q_world = glm::angleAxis(pi + 0.1, z_axis)};
  const RelativePort port = relative_port(chaser, {.point_m = {1.5, 0.0, 0.0}}, target,
                                          {.point_m = {3.0, 0.0, 0.0}}, rtstdb::world_time_ns(0));
  EXPECT_NEAR(port.distance_m, 10.0, 1e-12);
  EXPECT_NEAR(port.lateral_m, 2.0, 1e-12);
  EXPECT_NEAR(port.off_axis_rad, std::atan2(2.0, 10.0), 1e-12);
  EXPECT_NEAR(port.misalignment_rad, 0.1, 1e-12);
  EXPECT_NEAR(port.closing_speed_mps, 0.0, 1e-12);
  EXPECT_NEAR(port.lateral_speed_mps, 0.0, 1e-12);
}

TEST(RelativePort, ChaserBehindThePort) {
  const RelativePort port =
      relative_port({.p_world_m = {-1.0, 0.0, 0.0}}, {}, {}, {}, rtstdb::world_time_ns(0));
  EXPECT_DOUBLE_EQ(port.distance_m, -1.0);
  EXPECT_NEAR(port.off_axis_rad, pi, 1e-12);
  EXPECT_NEAR(port.misalignment_rad, pi, 1e-12);
}

TEST(RelativePort, SpeedsAlongAndAcrossTheAxis) {
  // The axis looks along the world's y.
  const rtstdb::Motion target{.q_world = glm::angleAxis(0.5 * pi, z_axis), .v_world_mps = {1.0, 2.0, 3.0}};
  const rtstdb::Motion chaser{.p_world_m = {0.0, 5.0, 0.0}, .v_world_mps = {1.03, 1.9, 3.04}};
  const RelativePort port = relative_port(chaser, {}, target, {}, rtstdb::world_time_ns(0));
  EXPECT_NEAR(port.closing_speed_mps, 0.1, 1e-12);
  EXPECT_NEAR(port.lateral_speed_mps, 0.05, 1e-12);
}

/// Bodies that turn: the velocities are those by which the distances change.
TEST(RelativePort, SpeedsAreTheChangesOfTheDistances) {
  const rtstdb::Motion target{.p_world_m = {5.0, -3.0, 2.0},
                              .q_world = glm::angleAxis(0.4, glm::normalize(dvec3(1.0, 2.0, 0.3))),
                              .v_world_mps = {0.2, -0.1, 0.05},
                              .w_world_radps = {0.02, -0.03, 0.01}};
  const rtstdb::Motion chaser{.p_world_m = {20.0, 4.0, -1.0},
                              .q_world = glm::angleAxis(2.4, glm::normalize(dvec3(-1.0, 0.4, 3.0))),
                              .v_world_mps = {-0.5, 0.3, 0.1},
                              .w_world_radps = {-0.01, 0.04, 0.05}};
  const BodyPort chaser_port{.point_m = {1.5, 0.2, -0.1}, .axis = glm::normalize(dvec3(1.0, 0.1, 0.0))};
  const BodyPort target_port{.point_m = {0.0, 4.0, 0.5}, .axis = {0.0, 1.0, 0.0}};
  const auto at = [&](std::int64_t t_ns) {
    return relative_port(chaser, chaser_port, target, target_port, rtstdb::world_time_ns(t_ns));
  };
  // The motions' velocities are those of the instant from which they hold.
  const RelativePort before = at(-50'000), now = at(0), after = at(50'000);
  EXPECT_NEAR((before.distance_m - after.distance_m) / 1e-4, now.closing_speed_mps, 1e-6);
  // The change of the lateral distance is at most the lateral speed.
  const double change_mps = (after.lateral_m - before.lateral_m) / 1e-4;
  EXPECT_LE(std::abs(change_mps), now.lateral_speed_mps + 1e-6);
  EXPECT_GT(now.lateral_speed_mps, 0.1);
}

}  // namespace
}  // namespace hil::modules
