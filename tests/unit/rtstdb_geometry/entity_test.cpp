#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <rtstdb/entity.hpp>

namespace rtstdb {
namespace {

constexpr double pi = std::numbers::pi;

WorldTime at_s(double seconds) {
  return world_time_ns(std::llround(seconds * 1e9));
}

/// The angle between two orientations, either sign of the quaternion.
double angle_between(const glm::dquat& a, const glm::dquat& b) {
  const glm::dquat difference = glm::conjugate(a) * b;
  return 2.0 * std::atan2(glm::length(glm::dvec3(difference.x, difference.y, difference.z)),
                          std::abs(difference.w));
}

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") against (" << b.x
                                           << ", " << b.y << ", " << b.z << ")";
}

struct RandomMotion {
  std::mt19937_64 engine;
  std::normal_distribution<double> normal;
  glm::dvec3 vector() { return {normal(engine), normal(engine), normal(engine)}; }
  Motion operator()() {
    Motion motion;
    motion.p_world_m = 100.0 * vector();
    motion.q_world = glm::normalize(glm::dquat(normal(engine), vector()));
    motion.v_world_mps = 20.0 * vector();
    motion.w_world_radps = 5.0 * vector();
    motion.valid_from = at_s(normal(engine));
    return motion;
  }
};

TEST(SecondsBetween, IsExactButForOneRounding) {
  EXPECT_EQ(seconds_between(world_time_ns(0), world_time_ns(3'000'000'000)), 3.0);
  EXPECT_EQ(seconds_between(world_time_ns(3'000'000'000), world_time_ns(0)), -3.0);
  // Also at the end of the range of times.
  const std::int64_t far = std::numeric_limits<std::int64_t>::max() - 5;
  EXPECT_EQ(seconds_between(world_time_ns(far), world_time_ns(far + 1)), 1e-9);
  EXPECT_EQ(seconds_between(WorldTime::min(), WorldTime::max()), 18446744073709551615.0 / 1e9);
  EXPECT_EQ(seconds_between(WorldTime::max(), WorldTime::min()), -18446744073709551615.0 / 1e9);
}

TEST(PoseAt, AtValidFromIsThePoseOfTheRow) {
  RandomMotion random{std::mt19937_64(1), {}};
  for (int i = 0; i < 100; ++i) {
    const Motion motion = random();
    const Pose pose = pose_at(motion, motion.valid_from);
    EXPECT_EQ(pose.p_world_m, motion.p_world_m);
    EXPECT_LT(angle_between(pose.q_world, motion.q_world), 1e-15);
  }
}

TEST(PoseAt, TurnsByTheFullAngle) {
  // One radian a second for one second: an Euler step turns 2 atan(1/2) = 0.927 rad only.
  Motion motion;
  motion.w_world_radps = {0.0, 0.0, 1.0};
  const glm::dvec3 x_axis = pose_at(motion, at_s(1.0)).q_world * glm::dvec3(1.0, 0.0, 0.0);
  expect_near(x_axis, {std::cos(1.0), std::sin(1.0), 0.0}, 1e-15);
}

TEST(PoseAt, TurnsAboutTheAxisInTheWorldFrame) {
  Motion motion;
  motion.q_world =
      glm::angleAxis(pi / 2, glm::dvec3(1.0, 0.0, 0.0));  // the body's y axis is the world's z axis
  motion.w_world_radps = {0.0, 0.0, pi / 2};
  const glm::dquat q = pose_at(motion, at_s(1.0)).q_world;
  expect_near(q * glm::dvec3(0.0, 1.0, 0.0), {0.0, 0.0, 1.0}, 1e-15);
  expect_near(q * glm::dvec3(1.0, 0.0, 0.0), {0.0, 1.0, 0.0}, 1e-15);
}

TEST(PoseAt, ExtendsBeforeValidFrom) {
  Motion motion;
  motion.p_world_m = {1.0, 2.0, 3.0};
  motion.v_world_mps = {10.0, 0.0, -1.0};
  motion.w_world_radps = {0.0, 0.0, pi};
  motion.valid_from = at_s(5.0);
  const Pose pose = pose_at(motion, at_s(4.5));
  expect_near(pose.p_world_m, {-4.0, 2.0, 3.5}, 1e-14);
  expect_near(pose.q_world * glm::dvec3(1.0, 0.0, 0.0), {0.0, -1.0, 0.0}, 1e-15);
}

TEST(PoseAt, IsExactForSmallAngles) {
  // The angle is w t to the last digits on both sides of the switch between series and sine.
  for (int i = 0; i < 90; ++i) {
    const double rate_radps = 1e-12 * std::pow(1.37, i);
    Motion motion;
    motion.w_world_radps = glm::normalize(glm::dvec3(1.0, -2.0, 0.5)) * rate_radps;
    const glm::dquat q = pose_at(motion, at_s(1.0)).q_world;
    const double turned_rad = 2.0 * std::atan2(glm::length(glm::dvec3(q.x, q.y, q.z)), q.w);
    EXPECT_NEAR(turned_rad / rate_radps, 1.0, 4e-15) << rate_radps;
  }
  Motion still;
  EXPECT_EQ(pose_at(still, at_s(1e6)).q_world, glm::dquat(1.0, 0.0, 0.0, 0.0));
}

TEST(PoseAt, ComposesOverTime) {
  // Two steps give the same pose as one.
  RandomMotion random{std::mt19937_64(2), {}};
  for (int i = 0; i < 1000; ++i) {
    const Motion motion = random();
    const WorldTime middle = motion.valid_from + Nanoseconds(i * 1'234'567);
    const WorldTime end = middle + Nanoseconds(987'654'321);
    const Pose direct = pose_at(motion, end);
    const Pose stepped = pose_at(rebased(motion, middle), end);
    expect_near(stepped.p_world_m, direct.p_world_m, 1e-11);
    EXPECT_LT(angle_between(stepped.q_world, direct.q_world), 1e-13);
  }
}

TEST(Rebased, KeepsVelocitiesAndPoses) {
  RandomMotion random{std::mt19937_64(4), {}};
  for (int i = 0; i < 200; ++i) {
    const Motion motion = random();
    const WorldTime t = motion.valid_from + Nanoseconds(-700'000'000 + i * 7'000'000);
    const Motion later = rebased(motion, t);
    EXPECT_EQ(later.valid_from, t);
    EXPECT_EQ(later.v_world_mps, motion.v_world_mps);
    EXPECT_EQ(later.w_world_radps, motion.w_world_radps);
    const WorldTime probe = at_s(random.normal(random.engine));
    expect_near(pose_at(later, probe).p_world_m, pose_at(motion, probe).p_world_m, 1e-11);
    EXPECT_LT(angle_between(pose_at(later, probe).q_world, pose_at(motion, probe).q_world), 1e-13);
  }
}

TEST(PoseAt, IsDefinedForEveryTime) {
  Motion motion;
  motion.v_world_mps = {1.0, 0.0, 0.0};
  motion.w_world_radps = {0.0, 0.0, 1e4};
  motion.valid_from = WorldTime::min();
  const Pose pose = pose_at(motion, WorldTime::max());
  EXPECT_EQ(pose.p_world_m.x, 18446744073709551615.0 / 1e9);
  EXPECT_NEAR(glm::length(pose.q_world), 1.0, 1e-15);
}

}  // namespace
}  // namespace rtstdb
