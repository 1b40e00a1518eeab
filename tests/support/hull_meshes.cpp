#include "tests/support/hull_meshes.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace rtstdb::test {

TriangleMesh make_random_hull(std::uint64_t seed, std::uint32_t corners, const glm::dvec3& half_axes_m) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) / 9007199254740992.0; };
  const double apart = 1.0 / std::sqrt(static_cast<double>(corners));
  std::vector<glm::dvec3> directions;
  while (directions.size() < corners) {
    const double z = 2.0 * uniform() - 1.0;
    const double turn_rad = 2.0 * std::numbers::pi * uniform();
    const double across = std::sqrt(1.0 - z * z);
    const glm::dvec3 direction{across * std::cos(turn_rad), across * std::sin(turn_rad), z};
    const bool is_apart = std::ranges::all_of(
        directions, [&](const glm::dvec3& other) { return glm::distance(other, direction) >= apart; });
    if (is_apart) directions.push_back(direction);
  }
  std::vector<glm::vec3> points_m;
  points_m.reserve(corners);
  for (const glm::dvec3& direction : directions)
    points_m.emplace_back(half_axes_m * direction);
  return make_hull(points_m).value();
}

TriangleMesh make_two_sided_rectangle(double size_x_m, double size_y_m) {
  TriangleMesh mesh = make_rectangle(size_x_m, size_y_m);
  for (std::size_t i = 0; i < 2; ++i) {
    const glm::uvec3 triangle = mesh.triangles[i];
    mesh.triangles.emplace_back(triangle.x, triangle.z, triangle.y);
  }
  return mesh;
}

}  // namespace rtstdb::test
