// The driver against the Intelligent Driver Model's known properties (Treiber, Hennecke, Helbing 2000).

#include "runtime/modules/vehicles/driver.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hil::modules {
namespace {

constexpr double max_braking_mps2 = 9.0;
constexpr double dt_s = 0.001;

struct Car {
  double travelled_m = 0.0;
  double speed_mps = 0.0;
  void drive(const DriverModel& driver, const Ahead& ahead) {
    const Travel moved =
        travel(speed_mps, idm_acceleration(driver, speed_mps, ahead, max_braking_mps2), dt_s);
    travelled_m += moved.distance_m;
    speed_mps = moved.speed_mps;
  }
};

TEST(Driver, AcceleratesFromRestAndKeepsTheDesiredSpeed) {
  const DriverModel driver;
  EXPECT_DOUBLE_EQ(idm_acceleration(driver, 0.0, {}, max_braking_mps2), driver.acceleration_mps2);
  EXPECT_DOUBLE_EQ(idm_acceleration(driver, driver.desired_speed_mps, {}, max_braking_mps2), 0.0);
}

TEST(Driver, ReachesTheDesiredSpeedOnAFreeRoad) {
  DriverModel driver;
  driver.desired_speed_mps = 20.0;
  for (const double start_mps : {0.0, 5.0, 19.0, 30.0}) {
    Car car{.speed_mps = start_mps};
    double before_mps = start_mps;
    for (int i = 0; i < 120'000; ++i) {
      car.drive(driver, {});
      // Monotonic, without overshoot.
      if (start_mps < 20.0) {
        ASSERT_GE(car.speed_mps, before_mps);
      } else {
        ASSERT_LE(car.speed_mps, before_mps);
      }
      before_mps = car.speed_mps;
    }
    EXPECT_NEAR(car.speed_mps, 20.0, 1e-3) << "from " << start_mps;
  }
}

TEST(Driver, StopsBehindAStandingLeader) {
  for (const double speed_mps : {3.0, 10.0, 14.0, 25.0}) {
    DriverModel driver;
    driver.desired_speed_mps = speed_mps;
    const double leader_m = 150.0;
    Car car{.speed_mps = speed_mps};
    double max_seen_mps2 = 0.0;
    for (int i = 0; i < 300'000; ++i) {
      const double before_mps = car.speed_mps;
      car.drive(driver, {leader_m - car.travelled_m, 0.0});
      max_seen_mps2 = std::max(max_seen_mps2, (before_mps - car.speed_mps) / dt_s);
      ASSERT_LT(car.travelled_m, leader_m) << "touched from " << speed_mps << " m/s";
    }
    EXPECT_LT(car.speed_mps, 0.05) << "from " << speed_mps;
    EXPECT_NEAR(leader_m - car.travelled_m, driver.standstill_gap_m, 0.25) << "from " << speed_mps;
    // The leader is far away: about the comfortable deceleration is enough.
    EXPECT_LT(max_seen_mps2, 1.3 * driver.comfortable_mps2) << "from " << speed_mps;
  }
}

TEST(Driver, FollowsAtTheEquilibriumGapOfTheModel) {
  DriverModel driver;
  driver.desired_speed_mps = 20.0;
  const double leader_mps = 12.0;
  Car car{.speed_mps = 20.0};
  double leader_m = 60.0;
  for (int i = 0; i < 300'000; ++i) {
    car.drive(driver, {leader_m - car.travelled_m, leader_mps});
    leader_m += leader_mps * dt_s;
  }
  // Treiber et al., equation 5: s_e(v) = (s0 + v T) / sqrt(1 - (v / v0)^4).
  const double equilibrium_m = (driver.standstill_gap_m + leader_mps * driver.headway_s) /
                               std::sqrt(1.0 - std::pow(leader_mps / driver.desired_speed_mps, 4.0));
  EXPECT_NEAR(car.speed_mps, leader_mps, 1e-2);
  EXPECT_NEAR(leader_m - car.travelled_m, equilibrium_m, 0.05);
}

TEST(Driver, IsBoundedForEveryDistanceAndSpeed) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> speed(0.0, 100.0);
  std::uniform_real_distribution<double> gap_exponent(-6.0, 9.0);
  for (int i = 0; i < 100'000; ++i) {
    DriverModel driver;
    driver.desired_speed_mps = 0.1 + speed(random);
    const double gap_m = (i % 50 == 0 ? -1.0 : 1.0) * std::pow(10.0, gap_exponent(random));
    const double a = idm_acceleration(driver, speed(random), {gap_m, speed(random)}, max_braking_mps2);
    ASSERT_TRUE(std::isfinite(a));
    ASSERT_GE(a, -max_braking_mps2);
    ASSERT_LE(a, driver.acceleration_mps2);
  }
}

TEST(Driver, BrakesWithTheLimitAtContactAndFarAboveTheDesiredSpeed) {
  DriverModel driver;
  EXPECT_DOUBLE_EQ(idm_acceleration(driver, 1.0, {0.0, 0.0}, max_braking_mps2), -max_braking_mps2);
  EXPECT_DOUBLE_EQ(idm_acceleration(driver, 0.0, {-3.0, 20.0}, max_braking_mps2), -max_braking_mps2);
  driver.desired_speed_mps = 5.0;
  EXPECT_DOUBLE_EQ(idm_acceleration(driver, 50.0, {}, max_braking_mps2), -max_braking_mps2);
}

TEST(Driver, BrakesHarderAtSmallerDistanceAndHigherSpeed) {
  const DriverModel driver;
  const auto a = [&](double gap_m, double leader_mps) {
    return idm_acceleration(driver, 12.0, {gap_m, leader_mps}, 1e9);
  };
  EXPECT_LT(a(20.0, 10.0), a(30.0, 10.0));
  EXPECT_LT(a(30.0, 5.0), a(30.0, 10.0));
}

TEST(BrakingDistance, DecidesWhetherACarCanStop) {
  // 10 m/s with 5 m/s2: v^2 / 2a = 10 m.
  EXPECT_TRUE(can_stop(10.0, 10.0, 5.0));
  EXPECT_FALSE(can_stop(10.0, 9.999, 5.0));
  EXPECT_TRUE(can_stop(0.0, 0.001, 5.0));
  EXPECT_FALSE(can_stop(0.0, 0.0, 5.0));
  EXPECT_FALSE(can_stop(1.0, -4.0, 5.0));
}

TEST(Travel, IsExactAtConstantAcceleration) {
  const Travel moved = travel(10.0, 2.0, 3.0);
  EXPECT_DOUBLE_EQ(moved.distance_m, 10.0 * 3.0 + 0.5 * 2.0 * 9.0);
  EXPECT_DOUBLE_EQ(moved.speed_mps, 16.0);
}

TEST(Travel, OfManyStepsIsThatOfOneStep) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> speed(0.0, 30.0);
  std::uniform_real_distribution<double> acceleration(-9.0, 3.0);
  for (int i = 0; i < 1000; ++i) {
    const double v = speed(random);
    const double a = acceleration(random);
    const Travel whole = travel(v, a, 4.0);
    double travelled_m = 0.0;
    double v_now = v;
    for (int k = 0; k < 400; ++k) {
      const Travel part = travel(v_now, v_now == 0.0 && a < 0.0 ? 0.0 : a, 0.01);
      travelled_m += part.distance_m;
      v_now = part.speed_mps;
    }
    ASSERT_NEAR(travelled_m, whole.distance_m, 1e-9);
    ASSERT_NEAR(v_now, whole.speed_mps, 1e-9);
  }
}

TEST(Travel, EndsAtRestAndNeverGoesBackward) {
  const Travel stopped = travel(2.0, -4.0, 10.0);
  EXPECT_DOUBLE_EQ(stopped.distance_m, 0.5);  // v^2 / 2a
  EXPECT_DOUBLE_EQ(stopped.speed_mps, 0.0);
  const Travel standing = travel(0.0, -9.0, 1.0);
  EXPECT_DOUBLE_EQ(standing.distance_m, 0.0);
  EXPECT_DOUBLE_EQ(standing.speed_mps, 0.0);
  EXPECT_FALSE(std::signbit(standing.speed_mps));
}

}  // namespace
}  // namespace hil::modules
