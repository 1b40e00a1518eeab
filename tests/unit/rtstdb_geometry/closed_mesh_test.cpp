#include "rtstdb/geometry/closed_mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

namespace rtstdb {
namespace {

/// The mesh with separate corners for each triangle.
TriangleMesh unshared(const TriangleMesh& mesh) {
  TriangleMesh separate;
  for (const glm::uvec3& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(separate.positions_m.size());
    for (int i = 0; i < 3; ++i)
      separate.positions_m.push_back(mesh.positions_m[triangle[i]]);
    separate.triangles.emplace_back(first, first + 1, first + 2);
  }
  return separate;
}

TEST(ClosedMesh, IsEachShapeButTheRectangle) {
  EXPECT_TRUE(is_closed(make_box({1.0, 2.0, 3.0})));
  EXPECT_TRUE(is_closed(make_cylinder(1.0, 2.0, 17)));
  EXPECT_TRUE(is_closed(make_sphere(1.0, 5)));
  EXPECT_FALSE(is_closed(make_rectangle(1.0, 2.0)));
}

TEST(ClosedMesh, SharesCornersByPosition) {
  EXPECT_TRUE(is_closed(unshared(make_sphere(2.0, 3))));
  TriangleMesh at_zero = unshared(make_box({2.0, 2.0, 2.0}));
  for (std::size_t i = 0; i < at_zero.positions_m.size(); ++i) {
    float& x = at_zero.positions_m[i].x;
    if (x > 0.0f) x = i % 2 == 0 ? 0.0f : -0.0f;
  }
  EXPECT_TRUE(is_closed(at_zero)) << "0 and -0 are one position";
}

TEST(ClosedMesh, HasEachTriangleOnceAndInOneDirection) {
  const TriangleMesh closed = make_sphere(1.0, 1);
  for (std::size_t i = 0; i < closed.triangles.size(); ++i) {
    TriangleMesh damaged = closed;
    std::swap(damaged.triangles[i].x, damaged.triangles[i].y);
    EXPECT_FALSE(is_closed(damaged)) << i;
    damaged = closed;
    damaged.triangles.erase(damaged.triangles.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_FALSE(is_closed(damaged)) << i;
    damaged = closed;
    damaged.triangles.push_back(closed.triangles[i]);
    EXPECT_FALSE(is_closed(damaged)) << i;
  }
}

TEST(ClosedMesh, MayHaveSeveralShellsAndTrianglesWithoutArea) {
  TriangleMesh mesh = make_box({4.0, 4.0, 4.0});
  const auto offset = static_cast<std::uint32_t>(mesh.positions_m.size());
  const TriangleMesh inner = make_sphere(1.0, 2);
  mesh.positions_m.insert(mesh.positions_m.end(), inner.positions_m.begin(), inner.positions_m.end());
  for (const glm::uvec3& triangle : inner.triangles)
    mesh.triangles.emplace_back(offset + triangle.y, offset + triangle.x, offset + triangle.z);
  mesh.triangles.emplace_back(0, 1, 0);
  mesh.triangles.emplace_back(3, 3, 3);
  EXPECT_TRUE(is_closed(mesh));
}

/// Corners move together, apart or not at all.
TEST(ClosedShapes, AgreeWithIsClosedForEveryShape) {
  std::mt19937 random(3);
  TriangleMesh holed = make_sphere(1.0, 2);
  holed.triangles.erase(holed.triangles.begin() + 20, holed.triangles.begin() + 23);
  TriangleMesh doubled = make_box({1.0, 1.0, 1.0});
  doubled.triangles.insert(doubled.triangles.end(), doubled.triangles.begin(), doubled.triangles.begin() + 2);
  int closed = 0, open = 0;
  for (const TriangleMesh& mesh : {make_sphere(1.0, 2), unshared(make_sphere(1.0, 2)), holed, unshared(holed),
                                   doubled, unshared(doubled), make_rectangle(1.0, 2.0)}) {
    const ClosedShapes shapes(mesh);
    const auto agree = [&](const TriangleMesh& shape) {
      ASSERT_EQ(shapes.is_closed(shape), is_closed(shape));
      (is_closed(shape) ? closed : open) += 1;
    };
    agree(mesh);
    for (int round = 0; round < 100; ++round) {
      TriangleMesh shape = mesh;
      const std::size_t count = shape.positions_m.size();
      // Corners at one position move together.
      for (glm::vec3& p : shape.positions_m)
        p = {p.y * 2.0f, p.x + p.z, p.z};
      agree(shape);
      // One corner moves to another one, and several move to the first one.
      shape.positions_m[random() % count] = shape.positions_m[random() % count];
      agree(shape);
      for (glm::vec3& p : shape.positions_m)
        if (random() % 3 == 0) p = shape.positions_m.front();
      agree(shape);
      for (glm::vec3& p : shape.positions_m)
        p.x = 0.0f * p.x;
      agree(shape);
    }
    TriangleMesh point = mesh;
    std::ranges::fill(point.positions_m, glm::vec3(3.0f));
    agree(point);
  }
  EXPECT_GT(closed, 100);
  EXPECT_GT(open, 100);
}

/// The corners around the hole of an open body move to one position.
TEST(ClosedShapes, CanCloseAHole) {
  TriangleMesh body = make_sphere(1.0, 2);
  const glm::uvec3 hole = body.triangles.back();
  body.triangles.pop_back();
  const ClosedShapes shapes(body);
  EXPECT_FALSE(shapes.is_closed(body));
  for (int i = 1; i < 3; ++i)
    body.positions_m[hole[i]] = body.positions_m[hole.x];
  EXPECT_TRUE(shapes.is_closed(body));
}

}  // namespace
}  // namespace rtstdb
