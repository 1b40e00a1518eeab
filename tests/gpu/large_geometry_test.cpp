// Rays at a geometry of five million triangles, compared with the oracle.

#include <cmath>
#include <numbers>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

/// A rough ball of rows times columns quadrilaterals.
TriangleMesh rough_ball(std::uint32_t rows, std::uint32_t columns, Random& random) {
  TriangleMesh mesh;
  for (std::uint32_t row = 0; row <= rows; ++row) {
    const double down = std::numbers::pi * row / rows;
    for (std::uint32_t column = 0; column <= columns; ++column) {
      const double turn = 2.0 * std::numbers::pi * column / columns;
      const double radius_m = 10.0 + 0.01 * random.uniform(-1.0, 1.0);
      mesh.positions_m.emplace_back(radius_m * glm::dvec3(std::sin(down) * std::cos(turn),
                                                          std::sin(down) * std::sin(turn), std::cos(down)));
    }
  }
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t a = row * (columns + 1) + column;
      const std::uint32_t b = a + columns + 1;
      mesh.triangles.emplace_back(a, b, b + 1);
      mesh.triangles.emplace_back(a, b + 1, a + 1);
    }
  }
  return mesh;
}

using LargeGeometry = DatabaseTest;

TEST_F(LargeGeometry, IsHitAsInTheOracle) {
  Random random(5);
  const TriangleMesh mesh = rough_ball(1600, 1563, random);
  ASSERT_GT(mesh.triangles.size(), 5'000'000u);
  create(row_of(add(mesh)));
  std::vector<Ray> rays;
  for (int i = 0; i < 20'000; ++i) {
    const glm::dvec3 from_m = 20.0 * random.direction();
    rays.push_back(ray_from(from_m, 14.0 * random.direction() - from_m));
  }
  const Tally tally = judge(world(), rays, trace(rays));
  EXPECT_GT(tally.hits, rays.size() / 5);
  EXPECT_LT(tally.hits, rays.size() * 4 / 5);
}

}  // namespace
}  // namespace rtstdb::test
