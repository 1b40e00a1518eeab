#pragma once
// Random numbers, directions and orientations from a seed.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

namespace rtstdb::test {

struct Random {
  std::mt19937_64 engine;
  explicit Random(std::uint64_t seed) : engine(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(engine); }
  /// Log-uniformly distributed.
  double magnitude(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  double normal() { return std::normal_distribution<double>()(engine); }
  /// From 0 to n - 1.
  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine); }
  /// From `low` to `high`, both included.
  int integer(int low, int high) { return std::uniform_int_distribution(low, high)(engine); }
  bool one_in(std::size_t n) { return below(n) == 0; }
  /// Normally distributed components.
  glm::dvec3 vector() {
    std::normal_distribution<double> component;
    const double x = component(engine);
    const double y = component(engine);
    return {x, y, component(engine)};
  }
  glm::dvec3 direction() { return glm::normalize(vector()); }
  glm::dquat orientation() { return glm::angleAxis(uniform(0.0, 6.28), direction()); }
};

}  // namespace rtstdb::test
