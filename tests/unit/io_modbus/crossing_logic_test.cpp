#include "configs/crossing/plc/crossing_logic.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hil::crossing::plc {
namespace {

constexpr std::int64_t scan_ms = 20;

/// Scans until the lights change. Returns the time until then; -1 when they do not change within the limit.
std::int64_t until_change(CrossingLogic& logic, const Inputs& inputs, std::int64_t limit_ms = 60'000) {
  const Outputs before = logic.outputs();
  for (std::int64_t passed = scan_ms; passed <= limit_ms; passed += scan_ms) {
    const Outputs& now = logic.step(inputs, scan_ms);
    if (now.ego != before.ego || now.cross != before.cross) return passed;
  }
  return -1;
}

void expect_lights(const CrossingLogic& logic, Light ego, Light cross) {
  EXPECT_EQ(logic.outputs().ego, ego);
  EXPECT_EQ(logic.outputs().cross, cross);
}

TEST(CrossingLogic, StaysGreenForTheCrossingRoadWithoutDemand) {
  CrossingLogic logic(Timing{});
  expect_lights(logic, Light::red, Light::green);
  EXPECT_EQ(until_change(logic, {}, 600'000), -1);
  EXPECT_EQ(until_change(logic, {.override_mode = 4711}), -1) << "an unknown override is none";
}

TEST(CrossingLogic, KeepsEveryPhaseTimeOnDemand) {
  const Timing timing;
  CrossingLogic logic(timing);
  Inputs waiting{.detector_ego = 1};
  EXPECT_EQ(until_change(logic, waiting), timing.minimum_green_ms);
  expect_lights(logic, Light::red, Light::yellow);
  EXPECT_TRUE(logic.outputs().demand_ego);
  EXPECT_EQ(until_change(logic, waiting), timing.yellow_ms);
  expect_lights(logic, Light::red, Light::red);
  EXPECT_EQ(until_change(logic, waiting), timing.all_red_ms);
  expect_lights(logic, Light::red_yellow, Light::red);
  EXPECT_EQ(until_change(logic, waiting), timing.red_yellow_ms);
  expect_lights(logic, Light::green, Light::red);
  logic.step({}, scan_ms);
  EXPECT_FALSE(logic.outputs().demand_ego);
}

TEST(CrossingLogic, RemembersAVehicleThatPassedTheDetector) {
  CrossingLogic logic(Timing{});
  logic.step({.detector_ego = 1}, scan_ms);
  EXPECT_EQ(until_change(logic, {}), Timing{}.minimum_green_ms - scan_ms);
  expect_lights(logic, Light::red, Light::yellow);
}

TEST(CrossingLogic, OccupiedRoadKeepsGreenUpToTheMaximum) {
  const Timing timing;
  for (const Inputs inputs : {Inputs{.detector_ego = 1, .detector_cross_right = 2},
                              Inputs{.detector_ego = 1, .detector_cross_left = 1}}) {
    CrossingLogic logic(timing);
    EXPECT_EQ(until_change(logic, inputs), timing.maximum_green_ms);
  }
}

TEST(CrossingLogic, RemainingGreenCountsBelowZero) {
  const Timing timing;
  CrossingLogic logic(timing);
  logic.step({}, 500);
  EXPECT_EQ(logic.outputs().green_remaining_ms, timing.minimum_green_ms - 500);
  logic.step({}, timing.minimum_green_ms);
  EXPECT_EQ(logic.outputs().green_remaining_ms, -500);
}

TEST(CrossingLogic, OverridesPassThroughSafePhases) {
  const Timing timing;
  CrossingLogic logic(timing);
  const Inputs ego{.override_mode = 1};
  until_change(logic, ego);
  expect_lights(logic, Light::red, Light::yellow);
  until_change(logic, ego);
  until_change(logic, ego);
  until_change(logic, ego);
  expect_lights(logic, Light::green, Light::red);
  EXPECT_EQ(until_change(logic, {.detector_cross_right = 9, .override_mode = 1}), -1)
      << "the override has priority over demand";
  const Inputs red{.override_mode = 3};
  until_change(logic, red);
  expect_lights(logic, Light::yellow, Light::red);
  until_change(logic, red);
  expect_lights(logic, Light::red, Light::red);
  EXPECT_EQ(until_change(logic, red), -1);
  until_change(logic, {.override_mode = 2});
  expect_lights(logic, Light::red, Light::red_yellow);
  until_change(logic, {.override_mode = 3});  // no phase of yellow after red and yellow
  expect_lights(logic, Light::red, Light::red);
}

TEST(CrossingLogic, LostClientTurnsAllLightsRedUntilItReturns) {
  Timing timing;
  timing.minimum_green_ms = 10'000;
  timing.maximum_green_ms = 20'000;
  CrossingLogic logic(timing);
  Inputs inputs;
  for (std::int64_t passed = 0; passed < 1000; passed += scan_ms) {
    ++inputs.heartbeat;
    logic.step(inputs, scan_ms);
  }
  EXPECT_EQ(until_change(logic, inputs), timing.watchdog_ms);  // in the middle of the minimum green
  EXPECT_TRUE(logic.outputs().watchdog_fault);
  expect_lights(logic, Light::red, Light::yellow);
  until_change(logic, inputs);
  expect_lights(logic, Light::red, Light::red);
  Inputs override_does_not_help = inputs;
  override_does_not_help.override_mode = 1;
  EXPECT_EQ(until_change(logic, override_does_not_help), -1);
  for (std::int64_t passed = 0; passed < 3000; passed += scan_ms) {
    ++inputs.heartbeat;
    logic.step(inputs, scan_ms);
  }
  EXPECT_FALSE(logic.outputs().watchdog_fault);
  expect_lights(logic, Light::red, Light::green);
}

TEST(CrossingLogic, WatchdogStartsWithTheFirstHeartbeat) {
  CrossingLogic logic(Timing{});
  logic.step({.heartbeat = 500}, scan_ms);  // an old value in the register
  EXPECT_EQ(until_change(logic, {.heartbeat = 500}, 60'000), -1);
  EXPECT_FALSE(logic.outputs().watchdog_fault);
}

/// Whether `after` may follow `before` on one road.
bool may_follow(Light before, Light after) {
  if (before == after) return true;
  switch (before) {
    case Light::red:
      return after == Light::red_yellow;
    case Light::red_yellow:
      return after == Light::green || after == Light::red;
    case Light::green:
      return after == Light::yellow;
    case Light::yellow:
      return after == Light::red;
  }
  return false;
}

struct RoadState {
  Light light = Light::red;
  std::int64_t since_ms = 0;  ///< the last change
};

TEST(CrossingLogic, RandomInputsNeverBreakTheRules) {
  std::mt19937 random(1234);
  int greens = 0;
  for (int round = 0; round < 200; ++round) {
    Timing timing;
    timing.minimum_green_ms = random() % 3000;
    timing.maximum_green_ms = timing.minimum_green_ms + random() % 5000;
    timing.yellow_ms = 20 + random() % 3000;
    timing.all_red_ms = 20 + random() % 2000;
    timing.red_yellow_ms = random() % 1000;
    CrossingLogic logic(timing);
    RoadState ego;
    RoadState cross{Light::green, 0};
    std::int64_t now_ms = 0;
    Inputs inputs;
    for (int scan = 0; scan < 5000; ++scan) {
      if (random() % 50 == 0) inputs.detector_ego = static_cast<std::uint16_t>(random() % 2 * random());
      if (random() % 50 == 0) inputs.detector_cross_right = static_cast<std::uint16_t>(random() % 3);
      if (random() % 50 == 0) inputs.detector_cross_left = static_cast<std::uint16_t>(random() % 2);
      if (random() % 200 == 0) inputs.override_mode = static_cast<std::uint16_t>(random() % 6);
      if (random() % 300 != 0) ++inputs.heartbeat;
      if (random() % 1000 == 0) inputs.heartbeat = static_cast<std::uint16_t>(inputs.heartbeat - 1);
      const std::int64_t elapsed = random() % 100 == 0 ? random() % 4000 : scan_ms;
      now_ms += elapsed;
      const Outputs& out = logic.step(inputs, elapsed);
      ASSERT_TRUE(out.ego == Light::red || out.cross == Light::red)
          << "round " << round << " at " << now_ms << " ms";
      for (auto [road, other, light] :
           {std::tuple(&ego, &cross, out.ego), std::tuple(&cross, &ego, out.cross)}) {
        ASSERT_TRUE(may_follow(road->light, light));
        if (light == road->light) continue;
        const std::int64_t held_ms = now_ms - road->since_ms;
        ASSERT_TRUE(road->light != Light::green || out.watchdog_fault || held_ms >= timing.minimum_green_ms);
        ASSERT_TRUE(road->light != Light::yellow || held_ms >= timing.yellow_ms);
        if (road->light == Light::red) {
          ASSERT_GE(held_ms, timing.all_red_ms);
          ASSERT_GE(now_ms - other->since_ms, timing.all_red_ms)
              << "the other road has not been red long enough";
        }
        greens += light == Light::green ? 1 : 0;
        *road = {light, now_ms};
      }
    }
  }
  EXPECT_GT(greens, 1000);
}

TEST(CrossingLogicDeathTest, TimeDoesNotGoBack) {
  CrossingLogic logic(Timing{});
  EXPECT_DEATH(logic.step({}, -1), "time goes backwards");
}

}  // namespace
}  // namespace hil::crossing::plc
