// The braking controller against a small simulation of the ego and one crossing car.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "configs/crossing/aeb_controller/controller.hpp"
#include "configs/crossing/aeb_controller/station.hpp"
#include "tests/paths.h"

namespace hil::crossing::aeb {
namespace {

constexpr std::int64_t ms = 1'000'000;

ObjectReport crossing_car(double x_m, double y_m, double velocity_y_mps, double age_s = 0.0) {
  return {true, x_m, y_m, 0.0, velocity_y_mps, 4.5, age_s};
}

TEST(FindConflict, FindsObjectsThatArriveTogether) {
  const Parameters parameters;
  const EgoState ego{10.0, 0.0};
  const auto conflict = find_conflict(ego, crossing_car(30.0, -30.0, 10.0), parameters);
  ASSERT_TRUE(conflict);
  EXPECT_NEAR(conflict->time_s, 2.9, 0.05);  // the front reaches the near side: (30 - 1) / 10
  EXPECT_NEAR(conflict->demand_mps2, 100.0 / (2.0 * 27.0), 1e-9);
  EXPECT_FALSE(find_conflict(ego, crossing_car(30.0, -90.0, 10.0), parameters))
      << "it arrives long after the ego";
  EXPECT_FALSE(find_conflict(ego, crossing_car(30.0, 30.0, 10.0), parameters)) << "it drives away";
  EXPECT_FALSE(find_conflict({0.0, 0.0}, crossing_car(30.0, -30.0, 10.0), parameters))
      << "the ego does not move";
  EXPECT_FALSE(find_conflict(ego, crossing_car(-10.0, -3.0, 10.0), parameters)) << "behind the front";
}

TEST(FindConflict, IsSymmetricInLeftAndRight) {
  const Parameters parameters;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int round = 0; round < 2000; ++round) {
    const EgoState ego{15.0 * std::abs(unit(random)), 0.0};
    ObjectReport object{
        true, 40.0 * unit(random), 40.0 * unit(random), 15.0 * unit(random), 15.0 * unit(random), 4.0, 0.0};
    const auto right = find_conflict(ego, object, parameters);
    object.y_m = -object.y_m;
    object.velocity_y_mps = -object.velocity_y_mps;
    const auto left = find_conflict(ego, object, parameters);
    ASSERT_EQ(right.has_value(), left.has_value());
    if (right) {
      ASSERT_DOUBLE_EQ(right->time_s, left->time_s);
      ASSERT_DOUBLE_EQ(right->demand_mps2, left->demand_mps2);
    }
  }
}

TEST(FindConflict, MissesNoCollisionOfASteppedSimulation) {
  Parameters parameters;
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int collisions = 0;
  for (int round = 0; round < 3000; ++round) {
    const EgoState ego{5.0 + 15.0 * unit(random), 0.0};
    const ObjectReport object{true,
                              10.0 + 40.0 * unit(random),
                              -40.0 * unit(random),
                              4.0 * unit(random) - 2.0,
                              4.0 + 14.0 * unit(random),
                              3.0 + 3.0 * unit(random),
                              0.0};
    const double heading = std::atan2(object.velocity_y_mps, object.velocity_x_mps);
    bool hit = false;
    for (double t = 0.0; t < parameters.horizon_s - 0.1 && !hit; t += 0.005) {
      // The object's outline against the ego's rectangle: points along its sides.
      for (int step = -10; step <= 10 && !hit; ++step) {
        for (const double side : {-1.0, 0.0, 1.0}) {
          const double along = 0.05 * step * object.length_m;
          const double x =
              object.x_m + object.velocity_x_mps * t + along * std::cos(heading) - side * std::sin(heading);
          const double y =
              object.y_m + object.velocity_y_mps * t + along * std::sin(heading) + side * std::cos(heading);
          const double forward = x - ego.speed_mps * t;
          hit = hit || (forward <= 0.0 && forward >= -parameters.ego_length_m &&
                        std::abs(y) <= parameters.ego_half_width_m);
        }
      }
    }
    collisions += hit ? 1 : 0;
    if (hit) {
      EXPECT_TRUE(find_conflict(ego, object, parameters)) << object.x_m << " " << object.y_m;
    }
  }
  EXPECT_GT(collisions, 100);
}

TEST(Extrapolation, MovesTheObjectAndTheEgo) {
  const ObjectReport straight = extrapolated({true, 50.0, -20.0, 1.0, 8.0, 4.0, 0.5}, {10.0, 0.0});
  EXPECT_DOUBLE_EQ(straight.x_m, 50.0 + 0.5 - 5.0);
  EXPECT_DOUBLE_EQ(straight.y_m, -16.0);
  EXPECT_EQ(straight.age_s, 0.0);
  // A quarter turn to the left on the spot: what was ahead is now on the right.
  const double quarter = std::acos(0.0);
  const ObjectReport turned = extrapolated({true, 10.0, 0.0, 2.0, 0.0, 4.0, 1.0}, {0.0, quarter});
  EXPECT_NEAR(turned.x_m, 0.0, 1e-12);
  EXPECT_NEAR(turned.y_m, -12.0, 1e-12);
  EXPECT_NEAR(turned.velocity_y_mps, -2.0, 1e-12);
}

TEST(Controller, CommandsNothingWithoutAFreshEgoStatus) {
  Controller controller;
  const ObjectReport near = crossing_car(12.0, -12.0, 14.0);
  EXPECT_TRUE(controller.object_list(0, std::span(&near, 1)).degraded);
  controller.ego_status(0, {14.0, 0.0});
  const BrakeDecision decision = controller.object_list(100 * ms, std::span(&near, 1));
  EXPECT_FALSE(decision.degraded);
  EXPECT_GT(decision.deceleration_mps2, 3.0);
  const BrakeDecision late = controller.object_list(101 * ms, std::span(&near, 1));
  EXPECT_TRUE(late.degraded);
  EXPECT_EQ(late.deceleration_mps2, 0.0);
}

TEST(Controller, BrakesUntilTheEgoStopsOrASecondPassesWithoutConflict) {
  Controller controller;
  const ObjectReport near = crossing_car(15.0, -14.0, 14.0);
  controller.ego_status(0, {14.0, 0.0});
  const double first = controller.object_list(0, std::span(&near, 1)).deceleration_mps2;
  EXPECT_GT(first, 3.0);
  EXPECT_LE(first, 9.0);
  controller.ego_status(500 * ms, {10.0, 0.0});
  EXPECT_EQ(controller.object_list(500 * ms, {}).deceleration_mps2, first) << "latched";
  controller.ego_status(1100 * ms, {9.0, 0.0});
  EXPECT_EQ(controller.object_list(1100 * ms, {}).deceleration_mps2, 0.0) << "one second without conflict";
  controller.ego_status(1200 * ms, {14.0, 0.0});
  EXPECT_GT(controller.object_list(1200 * ms, std::span(&near, 1)).deceleration_mps2, 3.0);
  controller.ego_status(1300 * ms, {0.05, 0.0});
  EXPECT_EQ(controller.object_list(1300 * ms, std::span(&near, 1)).deceleration_mps2, 0.0)
      << "the ego has stopped";
}

TEST(Controller, WarnsBeforeItBrakesAndIgnoresInvalidObjects) {
  Controller controller;
  controller.ego_status(0, {14.0, 0.0});
  ObjectReport far = crossing_car(45.0, -45.0, 14.0);
  const BrakeDecision warned = controller.object_list(0, std::span(&far, 1));
  EXPECT_TRUE(warned.warning);
  EXPECT_EQ(warned.deceleration_mps2, 0.0);
  far.valid = false;
  EXPECT_FALSE(controller.object_list(0, std::span(&far, 1)).warning);
}

/// Simulates the ego with the controller, which gets a list every `list_period_s` that is `age_s` old.
/// Returns whether the cars collide.
bool collides(bool obey, double list_period_s, double age_s, double ego_speed_mps, double object_y_m,
              double object_mps) {
  Controller controller;
  const Parameters parameters;
  double front_m = 0.0;
  double speed_mps = ego_speed_mps;
  double braking_mps2 = 0.0;
  constexpr double step_s = 0.01;
  constexpr double crossing_m = 60.0;
  double next_list_s = 0.0;
  for (int step = 0; step < 1000; ++step) {
    const double t = step * step_s;
    const auto now_ns = static_cast<std::int64_t>(t * 1e9);
    controller.ego_status(now_ns, {speed_mps, 0.0});
    const double y = object_y_m + object_mps * t;
    if (t >= next_list_s) {
      next_list_s += list_period_s;
      const ObjectReport object =
          crossing_car(crossing_m - front_m + speed_mps * age_s, y - object_mps * age_s, object_mps, age_s);
      const BrakeDecision decision = controller.object_list(now_ns, std::span(&object, 1));
      if (obey) braking_mps2 = decision.deceleration_mps2;
    }
    const bool overlaps_y = std::abs(y) < 0.5 * 4.5 + parameters.ego_half_width_m;
    const bool overlaps_x =
        front_m > crossing_m - 1.0 && front_m - parameters.ego_length_m < crossing_m + 1.0;
    if (overlaps_x && overlaps_y) return true;
    speed_mps = std::max(0.0, speed_mps - braking_mps2 * step_s);
    front_m += speed_mps * step_s;
  }
  return false;
}

TEST(Controller, BrakingPreventsEveryCollision) {
  constexpr double speeds_mps[] = {8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0};
  int hits_without = 0;
  for (const double period_s : {0.1, 1.0}) {
    for (const double age_s : {0.0, 0.3}) {
      for (const double speed : speeds_mps) {
        for (const double object_mps : speeds_mps) {
          for (const double early_s : {-0.4, -0.2, 0.0, 0.2, 0.4}) {
            const double object_y_m = -object_mps * (60.0 / speed + early_s);
            hits_without += collides(false, period_s, age_s, speed, object_y_m, object_mps) ? 1 : 0;
            EXPECT_FALSE(collides(true, period_s, age_s, speed, object_y_m, object_mps))
                << "lists every " << period_s << " s, " << age_s << " s old, ego " << speed << " m/s, object "
                << object_mps << " m/s, " << early_s << " s off";
          }
        }
      }
    }
  }
  EXPECT_GT(hits_without, 500);
}

class StationTest : public ::testing::Test {
 protected:
  can::Frame build(can::MessageEncoder& encoder, const std::vector<double>& values, io::RunTimeNs time_ns) {
    can::MessageEncoder::Tally tally;
    can::Frame frame = encoder.build(values, tally);
    encoder.confirm_sent();
    frame.direction = can::Direction::rx;
    frame.time_ns = time_ns;
    return frame;
  }
  const can::Dbc database_ = can::load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  const can::Protection protection_{"Counter", "Checksum"};
  can::MessageEncoder ego_{*database_.find_message("EgoStatus"), protection_};
  can::MessageEncoder object0_{*database_.find_message("Object0"), {}};
  can::MessageEncoder object1_{*database_.find_message("Object1"), {}};
  can::MessageEncoder header_{*database_.find_message("ObjectHeader"), protection_};
  can::MessageDecoder command_{*database_.find_message("BrakeCommand"), protection_};
  Station station_{database_};
  const std::vector<double> danger_{1.0, 15.0, -14.0, 0.0, 14.0, 4.5, 0.0};
};

TEST_F(StationTest, AnswersACompleteListWithItsNumber) {
  EXPECT_FALSE(station_.handle(build(ego_, {14.0, 0.0, 0.0, 0.0}, 0)));
  for (int list = 0; list < 3; ++list) {
    EXPECT_FALSE(station_.handle(build(object0_, danger_, 0)));
    const auto answer = station_.handle(build(header_, {0.0, 1.0, 0.0, 0.0}, 0));
    ASSERT_TRUE(answer);
    station_.confirm_sent();
    ASSERT_EQ(command_.check(*answer), can::MessageDecoder::Verdict::accepted);
    std::vector<double> values(6);
    command_.decode(*answer, [&](std::size_t signal, double value) { values[signal] = value; });
    EXPECT_GT(values[0], 3.0);
    EXPECT_EQ(values[1], 1.0);
    EXPECT_EQ(values[2], 0.0);
    EXPECT_EQ(values[3], list) << "AnswerTo";
  }
  EXPECT_EQ(station_.counters().answers, 3U);
}

TEST_F(StationTest, DoesNotAnswerAnIncompleteOrDamagedList) {
  station_.handle(build(ego_, {14.0, 0.0, 0.0, 0.0}, 0));
  station_.handle(build(object0_, danger_, 0));
  EXPECT_FALSE(station_.handle(build(header_, {0.0, 2.0, 0.0, 0.0}, 0))) << "Object1 is missing";
  EXPECT_EQ(station_.counters().incomplete_lists, 1U);
  station_.handle(build(object1_, danger_, 0));
  EXPECT_FALSE(station_.handle(build(header_, {0.0, 2.0, 0.0, 0.0}, 0)))
      << "Object0 belongs to the list before";
  can::Frame damaged = build(header_, {0.0, 0.0, 0.0, 0.0}, 0);
  damaged.raw.data[2] ^= 1U;
  EXPECT_FALSE(station_.handle(damaged));
  EXPECT_EQ(station_.counters().refused_frames, 1U);
  can::Frame foreign = can::make_frame(0x7AB, {});
  EXPECT_FALSE(station_.handle(foreign));
}

TEST_F(StationTest, AnswersAnEmptyListAndReportsTheDegradedState) {
  const auto answer = station_.handle(build(header_, {0.0, 0.0, 0.0, 0.0}, 0));
  ASSERT_TRUE(answer);
  std::vector<double> values(6);
  command_.decode(*answer, [&](std::size_t signal, double value) { values[signal] = value; });
  EXPECT_EQ(values[0], 0.0);
  EXPECT_EQ(values[2], 1.0) << "no EgoStatus yet";
}

TEST(StationDatabase, ReportsMissingMessagesAndSignals) {
  EXPECT_TRUE(
      Station::database_problems(can::load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database)
          .empty());
  const auto problems = Station::database_problems(can::parse_dbc("BO_ 1 EgoStatus: 8 A\n").database);
  EXPECT_GE(problems.size(), 8U);
  EXPECT_EQ(problems.front(), "message 'EgoStatus' has no signal 'Speed'");
}

}  // namespace
}  // namespace hil::crossing::aeb
