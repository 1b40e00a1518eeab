// The bounds of relative motion: no point exceeds the bounds of velocity and acceleration in the frame of a
// moving body.

#include "rtstdb/standing/relative_motion.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

Motion random_motion_of_body(Dice& dice) {
  Motion motion;
  motion.p_world_m = dice.vector(20.0);
  motion.q_world = dice.orientation();
  if (!dice.one_in(4)) motion.v_world_mps = dice.vector(10.0);
  if (!dice.one_in(4)) motion.w_world_radps = dice.vector(3.0);
  return motion;
}

constexpr std::int64_t step_ns = 100'000;

/// Velocity and acceleration from the differences of three positions, with their rounding error.
struct Path {
  glm::dvec3 v{0.0}, a{0.0};
  template <class Position>
  Path(std::int64_t ns, Position position) {
    const double h = static_cast<double>(step_ns) * 1e-9;
    const glm::dvec3 before = position(ns - step_ns);
    const glm::dvec3 now = position(ns);
    const glm::dvec3 after = position(ns + step_ns);
    v = (after - before) / (2.0 * h);
    a = (after - 2.0 * now + before) / (h * h);
  }
};
constexpr double rounding = 2e-4;

TEST(RelativeMotion, HasBoundsThatNoPointExceeds) {
  Dice dice(3);
  double tightest = 0.0;
  for (int round = 0; round < 4000; ++round) {
    Motion of = random_motion_of_body(dice);
    Motion from = random_motion_of_body(dice);
    if (dice.one_in(6)) from.w_world_radps = of.w_world_radps * dice.from(-2.0, 2.0);  // about one axis
    const RelativeMotion motion(of, from);
    const auto begin_ns = static_cast<std::int64_t>(dice.from(-1e9, 1e9));
    const auto end_ns = begin_ns + static_cast<std::int64_t>(dice.from(1e6, 1e9));
    const auto a = motion.at(begin_ns);
    const auto b = motion.at(end_ns);
    const glm::dvec3 r = dice.vector(3.0);
    glm::dvec3 n = glm::normalize(dice.vector(1.0) + glm::dvec3(1e-3, 0.0, 0.0));
    if (dice.one_in(3) && from.w_world_radps != glm::dvec3(0.0))
      n = glm::conjugate(from.q_world) * glm::normalize(from.w_world_radps);
    const double lever_m = glm::length(r);
    const auto target_bounds = motion.target_bounds(a, b, lever_m);
    const auto observer_bounds = motion.observer_bounds(a, b, lever_m);
    const double target_acceleration = motion.target_acceleration(a, b, n, lever_m);
    const double observer_acceleration = motion.observer_acceleration(a, b, n, lever_m);
    const auto edge_bounds = motion.direction_bounds(n);
    for (int k = 0; k < 8; ++k) {
      const auto ns =
          begin_ns + static_cast<std::int64_t>(dice.from(0.0, 1.0) * static_cast<double>(end_ns - begin_ns));
      const Path target(ns, [&](std::int64_t t) {
        const auto view = motion.at(t);
        return view.offset_m + view.rotation * r;
      });
      ASSERT_LE(glm::length(target.v), target_bounds.speed_mps + rounding) << round;
      ASSERT_LE(glm::length(target.a), target_bounds.acceleration_mps2 + rounding) << round;
      ASSERT_LE(std::abs(glm::dot(n, target.a)), target_acceleration + rounding) << round;
      const Path observer(ns, [&](std::int64_t t) {
        const auto view = motion.at(t);
        return (r - view.offset_m) * view.rotation;
      });
      ASSERT_LE(glm::length(observer.v), observer_bounds.speed_mps + rounding) << round;
      ASSERT_LE(glm::length(observer.a), observer_bounds.acceleration_mps2 + rounding) << round;
      ASSERT_LE(std::abs(glm::dot(n, observer.a)), observer_acceleration + rounding) << round;
      const Path edge(ns, [&](std::int64_t t) { return motion.at(t).rotation * n; });
      ASSERT_LE(glm::length(edge.v), edge_bounds.rate + rounding) << round;
      ASSERT_LE(glm::length(edge.a), edge_bounds.second_derivative + rounding) << round;
      if (target_acceleration > 1.0)
        tightest = std::max(tightest, std::abs(glm::dot(n, target.a)) / target_acceleration);
    }
  }
  EXPECT_GT(tightest, 0.9) << "the bounds are not tight";
}

/// Bodies that rotate alike, do not rotate, or rotate about the tested axis: the bound along the axis is
/// zero, so a search needs two samples.
TEST(RelativeMotion, HasZeroBoundsForStraightPaths) {
  Motion car;
  car.p_world_m = {5.0, 7.0, 0.0};
  car.v_world_mps = {20.0, 3.0, 0.0};
  car.w_world_radps = {0.0, 0.0, 0.7};
  const glm::dvec3 up(0.0, 0.0, 1.0);
  const auto acceleration = [&](const Motion& of, const Motion& from, const glm::dvec3& n) {
    const RelativeMotion motion(of, from);
    return motion.target_acceleration(motion.at(0), motion.at(2'000'000'000), n, 3.0);
  };
  Motion straight = car;
  straight.w_world_radps = {};
  EXPECT_EQ(acceleration(straight, Motion{}, up), 0.0);
  EXPECT_EQ(acceleration(straight, Motion{}, {1.0, 0.0, 0.0}), 0.0);
  EXPECT_LT(acceleration(car, Motion{}, up), 1e-12);
  EXPECT_LT(acceleration(Motion{}, car, up), 1e-12);
  EXPECT_LT(acceleration(straight, car, up), 1e-12);
  EXPECT_LT(acceleration(car, car, {1.0, 0.0, 0.0}), 1e-12);
  EXPECT_GT(acceleration(car, Motion{}, {1.0, 0.0, 0.0}), 1.0);
}

}  // namespace
}  // namespace rtstdb::standing::test
