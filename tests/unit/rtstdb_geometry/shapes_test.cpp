#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include <rtstdb/geometry.hpp>

namespace rtstdb {
namespace {

constexpr double pi = std::numbers::pi;

struct Triangle {
  glm::dvec3 a, b, c;
  glm::dvec3 twice_area() const { return glm::cross(b - a, c - a); }
};

Triangle corners(const TriangleMesh& mesh, const glm::uvec3& t) {
  return {glm::dvec3(mesh.positions_m[t.x]), glm::dvec3(mesh.positions_m[t.y]),
          glm::dvec3(mesh.positions_m[t.z])};
}

/// Sum of the tetrahedra between the origin and each triangle: the volume if all fronts are outside.
double signed_volume_m3(const TriangleMesh& mesh) {
  double volume = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const Triangle triangle = corners(mesh, t);
    volume += glm::dot(triangle.a, glm::cross(triangle.b, triangle.c)) / 6.0;
  }
  return volume;
}

double area_m2(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const glm::uvec3& t : mesh.triangles)
    area += 0.5 * glm::length(corners(mesh, t).twice_area());
  return area;
}

/// Closed, consistent winding (each directed edge once, with its reverse), sphere-like, every position used.
void expect_closed(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  std::set<std::uint32_t> used;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_TRUE(directed.emplace(t[i], t[(i + 1) % 3]).second) << "an edge is used twice in one direction";
      used.insert(t[i]);
    }
  }
  for (const auto& [from, to] : directed)
    EXPECT_TRUE(directed.contains({to, from})) << "edge " << from << "-" << to << " is open";
  EXPECT_EQ(used.size(), mesh.positions_m.size());
  const auto vertices = static_cast<std::int64_t>(mesh.positions_m.size());
  const auto edges = static_cast<std::int64_t>(directed.size() / 2);
  const auto faces = static_cast<std::int64_t>(mesh.triangles.size());
  EXPECT_EQ(vertices - edges + faces, 2);
}

/// For a convex body around the origin: each front faces away from it.
void expect_outward(const TriangleMesh& mesh) {
  for (const glm::uvec3& t : mesh.triangles) {
    const Triangle triangle = corners(mesh, t);
    EXPECT_GT(glm::dot(triangle.twice_area(), triangle.a + triangle.b + triangle.c), 0.0);
  }
}

TEST(MakeBox, IsAClosedOutwardBox) {
  const TriangleMesh mesh = make_box({2.0, 3.0, 0.5});
  EXPECT_EQ(mesh.triangles.size(), 12u);
  expect_closed(mesh);
  expect_outward(mesh);
  EXPECT_DOUBLE_EQ(signed_volume_m3(mesh), 3.0);
  EXPECT_DOUBLE_EQ(area_m2(mesh), 2.0 * (6.0 + 1.5 + 1.0));
  EXPECT_EQ(bounds_of(mesh).minimum_m, glm::vec3(-1.0f, -1.5f, -0.25f));
  EXPECT_EQ(bounds_of(mesh).maximum_m, glm::vec3(1.0f, 1.5f, 0.25f));
  EXPECT_TRUE(validate(mesh).ok());
}

TEST(MakeCylinder, IsAPrismInTheCylinder) {
  for (const std::uint32_t segments : {3u, 4u, 7u, 32u, 500u}) {
    const double r = 1.5;
    const double h = 4.0;
    const TriangleMesh mesh = make_cylinder(r, h, segments);
    EXPECT_EQ(mesh.triangles.size(), 4u * segments);
    expect_closed(mesh);
    expect_outward(mesh);
    const double cap_m2 = 0.5 * segments * r * r * std::sin(2.0 * pi / segments);
    const double side_m2 = 2.0 * segments * r * std::sin(pi / segments) * h;
    EXPECT_NEAR(signed_volume_m3(mesh) / (cap_m2 * h), 1.0, 1e-6);
    EXPECT_NEAR(area_m2(mesh) / (2.0 * cap_m2 + side_m2), 1.0, 1e-6);
    EXPECT_FLOAT_EQ(bounds_of(mesh).maximum_m.z, 2.0f);
    EXPECT_FLOAT_EQ(bounds_of(mesh).minimum_m.z, -2.0f);
    EXPECT_FLOAT_EQ(bounds_of(mesh).maximum_m.x, 1.5f);
  }
}

TEST(MakeSphere, ConvergesQuadratically) {
  const double ball_m3 = 4.0 / 3.0 * pi * 8.0;
  double last_missing_m3 = 0.0;
  for (std::uint32_t level = 0; level <= 5; ++level) {
    const TriangleMesh mesh = make_sphere(2.0, level);
    EXPECT_EQ(mesh.triangles.size(), 20u << (2 * level));
    expect_closed(mesh);
    expect_outward(mesh);
    for (const glm::vec3& p : mesh.positions_m)
      EXPECT_NEAR(glm::length(glm::dvec3(p)), 2.0, 1e-6);
    const double missing_m3 = ball_m3 - signed_volume_m3(mesh);
    EXPECT_GT(missing_m3, 0.0);
    if (level > 2) {
      EXPECT_NEAR(last_missing_m3 / missing_m3, 4.0, 0.25);
    }
    last_missing_m3 = missing_m3;
  }
}

TEST(MakeRectangle, FacesUp) {
  const TriangleMesh mesh = make_rectangle(4.0, 2.0);
  EXPECT_DOUBLE_EQ(area_m2(mesh), 8.0);
  for (const glm::uvec3& t : mesh.triangles)
    EXPECT_EQ(glm::normalize(corners(mesh, t).twice_area()), glm::dvec3(0.0, 0.0, 1.0));
  EXPECT_EQ(bounds_of(mesh).minimum_m, glm::vec3(-2.0f, -1.0f, 0.0f));
  EXPECT_EQ(bounds_of(mesh).maximum_m, glm::vec3(2.0f, 1.0f, 0.0f));
}

TEST(ShapesDeathTest, InvalidSizesAreMisuse) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(make_box({1.0, 0.0, 1.0}), "rtstdb was misused");
  EXPECT_DEATH(make_box({1.0, 1.0, nan}), "rtstdb was misused");
  EXPECT_DEATH(make_cylinder(1.0, 1.0, 2), "make_cylinder: segments have to be 3");
  EXPECT_DEATH(make_cylinder(-1.0, 1.0), "rtstdb was misused");
  EXPECT_DEATH(make_sphere(0.0), "rtstdb was misused");
  EXPECT_DEATH(make_sphere(1.0, 11), "make_sphere: subdivisions have to be 0 to 10");
  EXPECT_DEATH(make_rectangle(1.0, std::numeric_limits<double>::infinity()), "rtstdb was misused");
}

}  // namespace
}  // namespace rtstdb
