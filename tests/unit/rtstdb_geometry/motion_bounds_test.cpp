#include "rtstdb/geometry/motion_bounds.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace rtstdb {
namespace {

struct Case {
  Bounds bounds;
  glm::dvec3 scale;
  Motion motion;
  WorldTime t0, t1;
};

class RandomCase {
 public:
  explicit RandomCase(std::uint64_t seed) : engine_(seed) {}

  /// Turns up to `max_turns` over the window; sizes, speeds and scales over several orders of magnitude.
  Case operator()(double max_turns) {
    Case c;
    const glm::dvec3 corner = vector() * magnitude(0.01, 10.0);
    const glm::dvec3 extent = glm::abs(vector()) * magnitude(0.01, 10.0);
    c.bounds = {glm::vec3(corner), glm::vec3(corner + extent)};
    c.scale = {magnitude(0.01, 100.0), magnitude(0.01, 100.0), magnitude(0.01, 100.0)};
    c.motion.p_world_m = vector() * magnitude(0.1, 1e4);
    c.motion.q_world = glm::normalize(glm::dquat(normal_(engine_), vector()));
    c.motion.v_world_mps = vector() * (one_in(4) ? 0.0 : magnitude(0.01, 1000.0));
    const double window_s = magnitude(1e-4, 1.0);
    const double turned_rad = uniform(0.0, 2.0 * 3.14159265358979 * max_turns);
    glm::dvec3 axis = one_in(3) ? glm::dvec3(0.0, 0.0, 1.0) : glm::normalize(vector());
    c.motion.w_world_radps = axis * (turned_rad / window_s);
    c.motion.valid_from = world_time_ns(static_cast<std::int64_t>(uniform(-1e9, 1e9)));
    c.t0 = c.motion.valid_from + Nanoseconds(static_cast<std::int64_t>(uniform(-5e8, 2e9)));
    c.t1 = c.t0 + Nanoseconds(std::llround(window_s * 1e9));
    return c;
  }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }

 private:
  double magnitude(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool one_in(int n) { return std::uniform_int_distribution<int>(1, n)(engine_) == 1; }
  glm::dvec3 vector() { return {normal_(engine_), normal_(engine_), normal_(engine_)}; }

  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

/// The eight corners by the definition in entity.hpp.
std::vector<glm::dvec3> corners_at(const Case& c, WorldTime t) {
  const Pose pose = pose_at(c.motion, t);
  std::vector<glm::dvec3> corners;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 corner((i & 1) != 0 ? c.bounds.maximum_m.x : c.bounds.minimum_m.x,
                            (i & 2) != 0 ? c.bounds.maximum_m.y : c.bounds.minimum_m.y,
                            (i & 4) != 0 ? c.bounds.maximum_m.z : c.bounds.minimum_m.z);
    corners.push_back(pose.p_world_m + pose.q_world * (c.scale * corner));
  }
  return corners;
}

WorldBox sampled_box(const Case& c, int samples) {
  WorldBox box{glm::dvec3(1e300), glm::dvec3(-1e300)};
  for (int i = 0; i <= samples; ++i) {
    const WorldTime t = c.t0 + Nanoseconds((c.t1 - c.t0).count() * i / samples);
    for (const glm::dvec3& corner : corners_at(c, t)) {
      box.minimum_m = glm::min(box.minimum_m, corner);
      box.maximum_m = glm::max(box.maximum_m, corner);
    }
  }
  return box;
}

bool contains(const WorldBox& outer, const WorldBox& inner) {
  return glm::all(glm::lessThanEqual(outer.minimum_m, inner.minimum_m)) &&
         glm::all(glm::greaterThanEqual(outer.maximum_m, inner.maximum_m));
}

TEST(OrientedBox, AgreesWithTheCorners) {
  RandomCase random(1);
  for (int i = 0; i < 500; ++i) {
    const Case c = random(1.0);
    const OrientedBox box = oriented_box(c.bounds, c.scale, pose_at(c.motion, c.t0));
    const double tolerance_m = 1e-12 * (1.0 + glm::length(box.center_m) + glm::length(box.half_extent_m));
    for (int k = 0; k < 8; ++k) {
      const glm::dvec3 side((k & 1) != 0 ? 1.0 : -1.0, (k & 2) != 0 ? 1.0 : -1.0, (k & 4) != 0 ? 1.0 : -1.0);
      const glm::dvec3 reach = side * box.half_extent_m;
      const glm::dvec3 corner =
          box.center_m + box.axis[0] * reach.x + box.axis[1] * reach.y + box.axis[2] * reach.z;
      EXPECT_LE(glm::length(corner - corners_at(c, c.t0)[static_cast<std::size_t>(k)]), tolerance_m);
    }
  }
}

TEST(ReachM, IsTheFarthestCornerFromTheCentreOfRotation) {
  const Bounds off_centre{{1.0f, -2.0f, 0.0f}, {3.0f, 1.0f, 0.5f}};
  EXPECT_DOUBLE_EQ(reach_m(off_centre, {2.0, 1.0, 4.0}), std::sqrt(36.0 + 4.0 + 4.0));
}

TEST(MotionBounds, OfAStillEntityIsItsBox) {
  RandomCase random(2);
  Case c = random(1.0);
  c.motion.v_world_mps = {};
  c.motion.w_world_radps = {};
  const WorldBox exact = box_around(oriented_box(c.bounds, c.scale, pose_at(c.motion, c.t0)));
  const WorldBox box = motion_bounds(c.bounds, c.scale, c.motion, c.t0, c.t1);
  EXPECT_TRUE(contains(box, exact));
  EXPECT_LE(glm::length(box.minimum_m - exact.minimum_m) + glm::length(box.maximum_m - exact.maximum_m),
            1e-9);
}

TEST(MotionBounds, OfATranslationIsTheSweptBox) {
  const Bounds unit{{-1.0f, -1.0f, -1.0f}, {1.0f, 1.0f, 1.0f}};
  Motion motion;
  motion.v_world_mps = {10.0, -4.0, 0.0};
  const WorldBox box =
      motion_bounds(unit, glm::dvec3(1.0), motion, world_time_ns(0), world_time_ns(500'000'000));
  EXPECT_LE(glm::length(box.minimum_m - glm::dvec3(-1.0, -3.0, -1.0)), 1e-12);
  EXPECT_LE(glm::length(box.maximum_m - glm::dvec3(6.0, 1.0, 1.0)), 1e-12);
}

TEST(MotionBounds, DoesNotGrowAlongTheAxisOfRotation) {
  const Bounds car{{-2.0f, -1.0f, 0.0f}, {2.0f, 1.0f, 1.5f}};
  Motion motion;
  motion.w_world_radps = {0.0, 0.0, 3.0};
  const WorldBox box =
      motion_bounds(car, glm::dvec3(1.0), motion, world_time_ns(0), world_time_ns(1'000'000'000));
  EXPECT_NEAR(box.minimum_m.z, 0.0, 1e-12);
  EXPECT_NEAR(box.maximum_m.z, 1.5, 1e-12);
}

TEST(MotionBounds, ContainsWhatTheBoxesAtBothEndsDoNot) {
  // Half a turn: both ends are equal, and in between the long side is upright.
  Case c;
  c.bounds = {{-5.0f, -0.1f, -0.1f}, {5.0f, 0.1f, 0.1f}};
  c.scale = glm::dvec3(1.0);
  c.motion.w_world_radps = {0.0, 0.0, 3.14159265358979};
  c.t0 = world_time_ns(0);
  c.t1 = world_time_ns(1'000'000'000);
  const WorldBox at_ends = sampled_box(c, 1);
  const WorldBox in_between = sampled_box(c, 1000);
  EXPECT_FALSE(contains(at_ends, in_between));
  EXPECT_TRUE(contains(motion_bounds(c.bounds, c.scale, c.motion, c.t0, c.t1), in_between));
}

TEST(MotionBounds, ContainsEachPointAtEachTime) {
  RandomCase random(3);
  for (int i = 0; i < 20'000; ++i) {
    const Case c = random(i % 2 == 0 ? 0.1 : 4.0);
    const WorldBox box = motion_bounds(c.bounds, c.scale, c.motion, c.t0, c.t1);
    for (int k = 0; k < 40; ++k) {
      const auto offset =
          static_cast<std::int64_t>(random.uniform(0.0, 1.0) * static_cast<double>((c.t1 - c.t0).count()));
      const WorldTime t = k == 0 ? c.t0 : k == 1 ? c.t1 : c.t0 + Nanoseconds(offset);
      for (const glm::dvec3& corner : corners_at(c, t)) {
        ASSERT_TRUE(glm::all(glm::lessThanEqual(box.minimum_m, corner)) &&
                    glm::all(glm::lessThanEqual(corner, box.maximum_m)))
            << "case " << i << " at " << t.time_since_epoch().count();
      }
    }
  }
}

/// Median over random cases of the ratio of the box's sides to those of the sampled tight box.
double median_looseness(double max_turns, std::uint64_t seed) {
  RandomCase random(seed);
  std::vector<double> ratios;
  for (int i = 0; i < 500; ++i) {
    const Case c = random(max_turns);
    const WorldBox box = motion_bounds(c.bounds, c.scale, c.motion, c.t0, c.t1);
    const WorldBox tight = sampled_box(c, 400);
    for (int axis = 0; axis < 3; ++axis)
      ratios.push_back((box.maximum_m[axis] - box.minimum_m[axis]) /
                       (tight.maximum_m[axis] - tight.minimum_m[axis]));
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  return ratios[ratios.size() / 2];
}

TEST(MotionBounds, IsNearlyTight) {
  EXPECT_LT(median_looseness(0.05, 4), 1.02);  // a sharp bend within a scan
  EXPECT_LT(median_looseness(0.5, 5), 1.35);
  EXPECT_LT(median_looseness(4.0, 6), 1.35);  // a propeller
}

TEST(MotionBoundsDeathTest, AReversedWindowIsMisuse) {
  EXPECT_DEATH(motion_bounds({}, glm::dvec3(1.0), {}, world_time_ns(1), world_time_ns(0)),
               "the interval of time ends before it begins");
}

}  // namespace
}  // namespace rtstdb
