// The filter that estimates position and velocity.

#include "configs/docking/guidance/track.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace hil::docking::guidance {
namespace {

/// A body under a known acceleration, measured at 2 Hz with noise, each measurement 0.4 s old.
TEST(Track, FollowsABodyThroughOldAndNoisyPositions) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.05);
  const auto acceleration = [](double t) { return glm::dvec3(0.0, t < 20.0 ? -0.03 : 0.02, 0.005); };
  const double dt = 0.05, age = 0.4;
  std::vector<glm::dvec3> path;
  glm::dvec3 p(1.0, 40.0, -2.0), v(0.05, 0.0, 0.0);
  Track track;
  track.begin(p + glm::dvec3(0.3, -0.2, 0.1), 0.3, 0.3);
  double largest_m = 0.0, largest_mps = 0.0;
  for (int i = 0; i < 800; ++i) {
    const double t = i * dt;
    path.push_back(p);
    if (i % 10 == 9) {
      const glm::dvec3 then = path[path.size() - 1 - static_cast<std::size_t>(std::lround(age / dt))];
      track.update(then + glm::dvec3(noise(random), noise(random), noise(random)), 0.05, age);
    }
    if (t > 10.0) {
      largest_m = std::max(largest_m, glm::length(track.p_m() - p));
      largest_mps = std::max(largest_mps, glm::length(track.v_mps() - v));
    }
    const glm::dvec3 a = acceleration(t);
    p += v * dt + 0.5 * a * dt * dt;
    v += a * dt;
    track.predict(dt, a);
  }
  EXPECT_LT(largest_m, 0.12);
  EXPECT_LT(largest_mps, 0.03);
  EXPECT_LT(track.sigma_m(), 0.05);
}

TEST(Track, UncertaintyGrowsWithoutMeasurements) {
  Track track;
  track.begin({}, 0.01, 0.01);
  const double before = track.sigma_m();
  for (int i = 0; i < 100; ++i)
    track.predict(0.1, {});
  EXPECT_GT(track.sigma_m(), 5.0 * before);
}

}  // namespace
}  // namespace hil::docking::guidance
