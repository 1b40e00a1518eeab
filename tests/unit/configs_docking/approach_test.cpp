// The guidance in a closed loop with the equations of motion: it docks within the limits of the port.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "configs/docking/guidance/controller.hpp"
#include "runtime/modules/free_body/rigid_body.hpp"
#include "seen_reflectors.hpp"

namespace hil::docking::guidance {
namespace {

constexpr std::int64_t ms = 1'000'000;

/// The capsule of the scenario: 12 t, its port 2 m ahead of its centre of mass, in a low orbit.
modules::RigidBody body_of_capsule() {
  modules::MassProperties properties{.mass_kg = 12'000.0};
  properties.inertia_kgm2[0][0] = 2e4;
  properties.inertia_kgm2[1][1] = properties.inertia_kgm2[2][2] = 3e4;
  return {properties, 0.00113};
}

struct Capsule {
  modules::RigidBody body = body_of_capsule();
  modules::RigidBodyState state;
  glm::dvec3 arm_m() const { return state.q_world * glm::dvec3(2.0, 0.0, 0.0); }
  glm::dvec3 port_m() const { return state.p_world_m + arm_m(); }
  glm::dvec3 port_mps() const { return state.v_world_mps + glm::cross(body.w_world_radps(state), arm_m()); }
};

struct Arrival {
  bool arrived = false;
  double time_s = 0.0, lateral_m = 0.0, speed_mps = 0.0, lateral_mps = 0.0, misalignment_rad = 0.0;
  double largest_off_axis_rad = 0.0;  ///< beyond 1 m
  double largest_force_n = 0.0;
  Mode last_mode = Mode::search;
};

/// `hide`: whether the scanner detects nothing at a time.
template <typename Hide>
Arrival fly(const glm::dvec3& start_m, const glm::dvec3& start_mps, const glm::dvec3& turned_rad,
            const Hide& hide) {
  Capsule capsule;
  const glm::dquat attitude = test::facing_the_port(turned_rad);
  capsule.state = capsule.body.state(start_m - attitude * glm::dvec3(2.0, 0.0, 0.0), start_mps, attitude,
                                     {0.004, -0.003, 0.002});
  Controller controller;
  const Parameters parameters;
  modules::Wrench wrench;
  std::vector<Detection> list, sweep;
  Arrival arrival;
  std::uint32_t scan = 0;
  for (int t_ms = 0; t_ms < 200'000; t_ms += 10) {
    const std::int64_t now = t_ms * ms;
    controller.attitude(now, {capsule.state.q_world, capsule.body.w_body_radps(capsule.state)});
    if (t_ms % 500 == 250) {  // the middle of a sweep, whose list is sent 50 ms after its end
      sweep = hide(t_ms) ? std::vector<Detection>()
                         : test::seen_reflectors(capsule.port_m(), capsule.state.q_world,
                                                 parameters.scanner.mount_body_m);
    }
    if (t_ms % 500 == 50) {
      list = sweep;
      ++scan;
    }
    if (t_ms % 50 == 30) {
      const Command command = controller.detections(now, {scan, list, false});
      wrench = {command.force_body_n, command.torque_body_nm};
      arrival.last_mode = command.mode;
      for (int i = 0; i < 3; ++i)
        arrival.largest_force_n = std::max(arrival.largest_force_n, std::abs(command.force_body_n[i]));
    }
    capsule.state = capsule.body.step(capsule.state, wrench, 0.01);
    const glm::dvec3 port = capsule.port_m(), v = capsule.port_mps();
    const double lateral = std::hypot(port.x, port.z);
    if (port.y > 1.0)
      arrival.largest_off_axis_rad = std::max(arrival.largest_off_axis_rad, std::atan2(lateral, port.y));
    if (port.y > 0.0) continue;
    arrival.arrived = true;
    arrival.time_s = 1e-3 * t_ms;
    arrival.lateral_m = lateral;
    arrival.speed_mps = -v.y;
    arrival.lateral_mps = std::hypot(v.x, v.z);
    const glm::dvec3 ahead = capsule.state.q_world * glm::dvec3(1.0, 0.0, 0.0);
    arrival.misalignment_rad = std::acos(std::min(1.0, -ahead.y));
    return arrival;
  }
  return arrival;
}

Arrival fly(const glm::dvec3& start_m, const glm::dvec3& start_mps, const glm::dvec3& turned_rad) {
  return fly(start_m, start_mps, turned_rad, [](int) { return false; });
}

TEST(Approach, DocksWithinTheLimitsOfThePort) {
  const glm::dvec3 starts[] = {{3.0, 40.0, -2.0}, {0.0, 40.0, 0.0}, {-4.0, 35.0, 3.0}, {1.0, 20.0, 1.0}};
  for (const glm::dvec3& start : starts) {
    const Arrival arrival = fly(start, {0.01, -0.05, 0.01}, {0.03, -0.04, 0.05});
    const std::string name = "from " + std::to_string(start.x) + ", " + std::to_string(start.y);
    ASSERT_TRUE(arrival.arrived) << name;
    EXPECT_LT(arrival.lateral_m, 0.08) << name;
    EXPECT_LT(arrival.speed_mps, 0.095) << name;
    EXPECT_GT(arrival.speed_mps, 0.04) << name;
    EXPECT_LT(arrival.lateral_mps, 0.03) << name;
    EXPECT_LT(arrival.misalignment_rad, 0.03) << name;
    EXPECT_LT(arrival.largest_off_axis_rad, 0.2) << name;
    EXPECT_LT(arrival.time_s, 130.0) << name;
    EXPECT_LE(arrival.largest_force_n, 800.0);
  }
}

TEST(Approach, WithoutDetectionsTheCapsuleWaits) {
  const Arrival arrival = fly({3.0, 40.0, -2.0}, {}, {}, [](int) { return true; });
  EXPECT_FALSE(arrival.arrived);
  EXPECT_EQ(arrival.last_mode, Mode::search);
  EXPECT_EQ(arrival.largest_force_n, 0.0);
}

TEST(Approach, ContinuesAfterAShortLossAndStopsAfterALongOne) {
  EXPECT_TRUE(fly({1.0, 40.0, 1.0}, {}, {}, [](int t_ms) { return t_ms > 30'000 && t_ms < 34'000; }).arrived);
  const Arrival lost = fly({1.0, 40.0, 1.0}, {}, {}, [](int t_ms) { return t_ms > 30'000; });
  EXPECT_FALSE(lost.arrived);
  EXPECT_EQ(lost.last_mode, Mode::wait);
}

TEST(Approach, NoThrustWithoutAttitudeOrWhenDocked) {
  Controller controller;
  EXPECT_EQ(controller.detections(ms, {}).mode, Mode::blind);
  controller.attitude(2 * ms, {test::facing_the_port({0.1, 0.0, 0.0}), {}});
  const Command search = controller.detections(3 * ms, {.scan = 1});
  EXPECT_EQ(search.mode, Mode::search);
  EXPECT_LT(search.torque_body_nm.x, -10.0) << "it turns back";
  const Command docked = controller.detections(4 * ms, {.scan = 1, .docked = true});
  EXPECT_EQ(docked.mode, Mode::docked);
  EXPECT_EQ(glm::length(docked.torque_body_nm), 0.0);
  EXPECT_EQ(controller.detections(500 * ms, {.scan = 2}).mode, Mode::blind) << "the attitude is old";
}

}  // namespace
}  // namespace hil::docking::guidance
