// The bounds of relative motion: no point exceeds the bounds of velocity and acceleration in the frame of a
// moving body.

#include "rtstdb/standing/relative_motion.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace rtstdb::standing::test {
namespace {

class RandomMotions {
 public:
  explicit RandomMotions(std::uint32_t seed) : random_(seed) {}
  double from(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
  }
  bool one_in(std::uint32_t n) { return random_() % n == 0; }
  glm::dvec3 vector(double size) { return {from(-size, size), from(-size, size), from(-size, size)}; }
  glm::dvec3 unit() { return glm::normalize(vector(1.0) + glm::dvec3(1e-3, 0.0, 0.0)); }
  Motion motion() {
    Motion motion;
    motion.p_world_m = vector(20.0);
    motion.q_world = glm::normalize(glm::dquat(from(-1, 1), from(-1, 1), from(-1, 1), from(-1, 1) + 0.01));
    if (!one_in(4)) motion.v_world_mps = vector(10.0);
    if (!one_in(4)) motion.w_world_radps = vector(3.0);
    return motion;
  }

 private:
  std::mt19937 random_;
};

constexpr std::int64_t step_ns = 100'000;

/// Velocity and acceleration from the differences of three positions, with their rounding error.
struct Path {
  glm::dvec3 v{0.0}, a{0.0};
  template <class Place>
  Path(std::int64_t ns, Place place) {
    const double h = static_cast<double>(step_ns) * 1e-9;
    const glm::dvec3 before = place(ns - step_ns);
    const glm::dvec3 now = place(ns);
    const glm::dvec3 after = place(ns + step_ns);
    v = (after - before) / (2.0 * h);
    a = (after - 2.0 * now + before) / (h * h);
  }
};
constexpr double rounding = 2e-4;

TEST(RelativeMotion, NoPointExceedsItsBounds) {
  RandomMotions dice(3);
  double tightest = 0.0;
  for (int round = 0; round < 4000; ++round) {
    Motion of = dice.motion();
    Motion from = dice.motion();
    if (dice.one_in(6)) from.w_world_radps = of.w_world_radps * dice.from(-2.0, 2.0);  // about one axis
    const RelativeMotion motion(of, from);
    const auto begin_ns = static_cast<std::int64_t>(dice.from(-1e9, 1e9));
    const auto end_ns = begin_ns + static_cast<std::int64_t>(dice.from(1e6, 1e9));
    const auto a = motion.at(begin_ns);
    const auto b = motion.at(end_ns);
    const glm::dvec3 r = dice.vector(3.0);
    glm::dvec3 n = dice.unit();
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
      const Path seen(ns, [&](std::int64_t t) {
        const auto view = motion.at(t);
        return view.offset_m + view.rotation * r;
      });
      ASSERT_LE(glm::length(seen.v), target_bounds.speed_mps + rounding) << round;
      ASSERT_LE(glm::length(seen.a), target_bounds.acceleration_mps2 + rounding) << round;
      ASSERT_LE(std::abs(glm::dot(n, seen.a)), target_acceleration + rounding) << round;
      const Path back(ns, [&](std::int64_t t) {
        const auto view = motion.at(t);
        return (r - view.offset_m) * view.rotation;
      });
      ASSERT_LE(glm::length(back.v), observer_bounds.speed_mps + rounding) << round;
      ASSERT_LE(glm::length(back.a), observer_bounds.acceleration_mps2 + rounding) << round;
      ASSERT_LE(std::abs(glm::dot(n, back.a)), observer_acceleration + rounding) << round;
      const Path edge(ns, [&](std::int64_t t) { return motion.at(t).rotation * n; });
      ASSERT_LE(glm::length(edge.v), edge_bounds.rate + rounding) << round;
      ASSERT_LE(glm::length(edge.a), edge_bounds.second_derivative + rounding) << round;
      if (target_acceleration > 1.0)
        tightest = std::max(tightest, std::abs(glm::dot(n, seen.a)) / target_acceleration);
    }
  }
  EXPECT_GT(tightest, 0.9) << "and they are no idle bounds";
}

/// Bodies that rotate alike, do not rotate, or rotate about the tested axis: the bound along the axis is
/// zero, so a search needs two samples.
TEST(RelativeMotion, StraightPathsHaveZeroBounds) {
  Motion car;
  car.p_world_m = {5.0, 7.0, 0.0};
  car.v_world_mps = {20.0, 3.0, 0.0};
  car.w_world_radps = {0.0, 0.0, 0.7};
  const glm::dvec3 up(0.0, 0.0, 1.0);
  const auto bends = [&](const Motion& of, const Motion& from, const glm::dvec3& n) {
    const RelativeMotion motion(of, from);
    return motion.target_acceleration(motion.at(0), motion.at(2'000'000'000), n, 3.0);
  };
  Motion straight = car;
  straight.w_world_radps = {};
  EXPECT_EQ(bends(straight, Motion{}, up), 0.0);
  EXPECT_EQ(bends(straight, Motion{}, {1.0, 0.0, 0.0}), 0.0);
  EXPECT_LT(bends(car, Motion{}, up), 1e-12);
  EXPECT_LT(bends(Motion{}, car, up), 1e-12);
  EXPECT_LT(bends(straight, car, up), 1e-12);
  EXPECT_LT(bends(car, car, {1.0, 0.0, 0.0}), 1e-12);
  EXPECT_GT(bends(car, Motion{}, {1.0, 0.0, 0.0}), 1.0);
}

}  // namespace
}  // namespace rtstdb::standing::test
