#include "rtstdb/geometry/polygon.hpp"

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace rtstdb {
namespace {

/// Triangulates the polygon of all positions in their order.
std::vector<glm::uvec3> triangulated(const std::vector<glm::vec3>& positions_m) {
  std::vector<std::uint32_t> corners(positions_m.size());
  std::iota(corners.begin(), corners.end(), 0u);
  std::vector<glm::uvec3> triangles;
  triangulate_polygon(positions_m, corners, triangles);
  return triangles;
}

glm::dvec3 twice_area(const std::vector<glm::vec3>& p, const glm::uvec3& t) {
  return glm::cross(glm::dvec3(p[t.y] - p[t.x]), glm::dvec3(p[t.z] - p[t.x]));
}

/// Every triangle faces `normal`, and together they have the polygon's area.
void expect_tiled(const std::vector<glm::vec3>& positions_m, const glm::dvec3& normal, double area_m2) {
  const auto triangles = triangulated(positions_m);
  EXPECT_EQ(triangles.size(), positions_m.size() - 2);
  double sum_m2 = 0.0;
  for (const glm::uvec3& t : triangles) {
    const double part_m2 = 0.5 * glm::dot(twice_area(positions_m, t), normal);
    EXPECT_GE(part_m2, -1e-6 * area_m2);
    sum_m2 += part_m2;
  }
  EXPECT_NEAR(sum_m2, area_m2, 1e-5 * area_m2);
}

TEST(TriangulatePolygon, KeepsATriangle) {
  EXPECT_EQ(triangulated({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), (std::vector<glm::uvec3>{{0, 1, 2}}));
}

TEST(TriangulatePolygon, IgnoresPointsAndLines) {
  EXPECT_TRUE(triangulated({}).empty());
  EXPECT_TRUE(triangulated({{0, 0, 0}}).empty());
  EXPECT_TRUE(triangulated({{0, 0, 0}, {1, 0, 0}}).empty());
}

TEST(TriangulatePolygon, FollowsAConcaveOutline) {
  const std::vector<glm::vec3> arrow{{0, 0, 0}, {4, -2, 0}, {1, 0, 0}, {4, 2, 0}};
  expect_tiled(arrow, {0, 0, 1}, 2.0);
  // The same reversed and in the other planes.
  std::vector<glm::vec3> turned = arrow;
  std::reverse(turned.begin(), turned.end());
  expect_tiled(turned, {0, 0, -1}, 2.0);
  for (glm::vec3& p : turned)
    p = {p.z, p.x, p.y};
  expect_tiled(turned, {-1, 0, 0}, 2.0);
  for (glm::vec3& p : turned)
    p = {p.z, p.x, p.y};
  expect_tiled(turned, {0, -1, 0}, 2.0);
}

TEST(TriangulatePolygon, TilesRandomStars) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> radius(0.2, 2.0);
  for (int round = 0; round < 200; ++round) {
    const int n = 4 + round % 40;
    std::vector<glm::vec3> star;
    double twice_m2 = 0.0;
    for (int i = 0; i < n; ++i) {
      const double angle = 2.0 * 3.14159265358979 * i / n;
      const double r = radius(random);
      star.emplace_back(r * std::cos(angle), r * std::sin(angle), 3.0);
    }
    for (int i = 0; i < n; ++i) {
      const glm::dvec3 a(star[static_cast<std::size_t>(i)]);
      const glm::dvec3 b(star[static_cast<std::size_t>((i + 1) % n)]);
      twice_m2 += a.x * b.y - a.y * b.x;
    }
    expect_tiled(star, {0, 0, 1}, 0.5 * twice_m2);
  }
}

TEST(TriangulatePolygon, TerminatesForInvalidPolygons) {
  EXPECT_EQ(triangulated({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}).size(), 2u);
  EXPECT_EQ(triangulated({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {4, 4, 4}}).size(), 3u);
  EXPECT_EQ(triangulated({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}).size(), 2u);
  const float nan = std::nanf("");
  EXPECT_EQ(triangulated({{0, 0, 0}, {nan, 1, 0}, {1, 0, nan}, {0, 1, 0}}).size(), 2u);
}

}  // namespace
}  // namespace rtstdb
