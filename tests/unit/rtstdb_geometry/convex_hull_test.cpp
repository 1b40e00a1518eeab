// Which meshes are convex, and the corners and faces of their hulls.

#include "rtstdb/geometry/convex_hull.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/support/hull_meshes.hpp"

namespace rtstdb {
namespace {

TriangleMesh displaced(TriangleMesh mesh, const glm::vec3& by_m) {
  for (glm::vec3& p : mesh.positions_m)
    p += by_m;
  return mesh;
}

TriangleMesh together(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<std::uint32_t>(a.positions_m.size());
  a.positions_m.insert(a.positions_m.end(), b.positions_m.begin(), b.positions_m.end());
  for (const glm::uvec3& triangle : b.triangles)
    a.triangles.push_back(triangle + first);
  return a;
}

TriangleMesh inside_out(TriangleMesh mesh) {
  for (glm::uvec3& triangle : mesh.triangles)
    std::swap(triangle.y, triangle.z);
  return mesh;
}

/// Four triangles for each, with corners in the middle of its edges.
TriangleMesh subdivided(const TriangleMesh& mesh) {
  TriangleMesh fine;
  for (const glm::uvec3& triangle : mesh.triangles) {
    const glm::vec3 a = mesh.positions_m[triangle.x];
    const glm::vec3 b = mesh.positions_m[triangle.y];
    const glm::vec3 c = mesh.positions_m[triangle.z];
    const auto first = static_cast<std::uint32_t>(fine.positions_m.size());
    fine.positions_m.insert(fine.positions_m.end(),
                            {a, b, c, 0.5f * (a + b), 0.5f * (b + c), 0.5f * (c + a)});
    for (const glm::uvec3& part :
         {glm::uvec3(0, 3, 5), glm::uvec3(3, 1, 4), glm::uvec3(5, 4, 2), glm::uvec3(3, 4, 5)})
      fine.triangles.push_back(part + first);
  }
  return fine;
}

/// Every corner is behind every face, and the faces name all triangles of the mesh once.
void expect_hull(const ConvexHull& hull, const TriangleMesh& mesh) {
  for (const ConvexHull::Face& face : hull.faces) {
    EXPECT_NEAR(glm::length(face.normal), 1.0f, 1e-5f);
    EXPECT_GE(face.corner_count, 3u);
    const glm::vec3 on_face = hull.corners_m[hull.face_corners[face.first_corner]];
    for (const glm::vec3& corner : hull.corners_m)
      EXPECT_LE(glm::dot(face.normal, corner - on_face), 1e-4f);
    for (std::uint32_t i = 0; i < face.corner_count; ++i) {
      const auto corner = [&](std::uint32_t k) {
        return hull.corners_m[hull.face_corners[face.first_corner + k % face.corner_count]];
      };
      const glm::vec3 turn = glm::cross(corner(i + 1) - corner(i), corner(i + 2) - corner(i + 1));
      EXPECT_GE(glm::dot(turn, face.normal), -1e-5f) << "the corners are not counter-clockwise";
    }
  }
  std::vector<std::uint32_t> triangles = hull.face_triangles;
  std::ranges::sort(triangles);
  EXPECT_EQ(std::ranges::adjacent_find(triangles), triangles.end());
  EXPECT_LE(triangles.size(), mesh.triangles.size());
}

struct Sizes {
  std::size_t corners = 0, faces = 0;
  friend bool operator==(const Sizes&, const Sizes&) = default;
};

Sizes sizes_of(const TriangleMesh& mesh) {
  const auto hull = convex_hull_of(mesh);
  if (!hull) return {};
  expect_hull(*hull, mesh);
  return {hull->corners_m.size(), hull->faces.size()};
}

TEST(ConvexHull, TrianglesOfOnePlaneAreOneFace) {
  EXPECT_EQ(sizes_of(make_box({1.0, 2.0, 3.0})), (Sizes{8, 6}));
  EXPECT_EQ(sizes_of(make_cylinder(0.5, 2.0, 24)), (Sizes{48, 26}));
  EXPECT_EQ(sizes_of(make_sphere(1.0, 2)), (Sizes{162, 320}));
  EXPECT_EQ(sizes_of(test::make_two_sided_rectangle(2.0, 3.0)), (Sizes{4, 2}));
}

TEST(ConvexHull, CornersInsideFacesAndEdgesAreLeftOut) {
  EXPECT_EQ(sizes_of(subdivided(make_box({1.0, 1.0, 1.0}))), (Sizes{8, 6}));
  EXPECT_EQ(sizes_of(subdivided(subdivided(make_box({1.0, 1.0, 1.0})))), (Sizes{8, 6}));
  EXPECT_EQ(sizes_of(subdivided(test::make_two_sided_rectangle(2.0, 3.0))).faces, 2u);
}

TEST(ConvexHull, RepeatedTrianglesCountOnce) {
  TriangleMesh mesh = make_box({1.0, 2.0, 3.0});
  for (int i = 0; i < 100'000; ++i)
    mesh.triangles.push_back(mesh.triangles[mesh.triangles.size() % 12]);
  while (mesh.triangles.size() % 12 != 0)
    mesh.triangles.push_back(mesh.triangles[mesh.triangles.size() % 12]);
  EXPECT_EQ(sizes_of(mesh), (Sizes{8, 6}));
}

TEST(ConvexHull, FrontsMayBeInside) {
  const TriangleMesh mesh = inside_out(make_box({1.0, 2.0, 3.0}));
  const auto hull = convex_hull_of(mesh);
  ASSERT_TRUE(hull);
  expect_hull(*hull, mesh);
}

TEST(ConvexHull, FarFromTheOriginRoundingIsAllowed) {
  EXPECT_EQ(sizes_of(displaced(make_box({10.0, 20.0, 30.0}), {300.0f, -200.0f, 100.0f})), (Sizes{8, 6}));
}

TEST(ConvexHull, RandomHullsAreConvex) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const TriangleMesh mesh = test::make_random_hull(seed, 8 + static_cast<std::uint32_t>(seed) * 3,
                                                     {0.2 + 0.01 * static_cast<double>(seed), 0.7, 1.0});
    EXPECT_EQ(sizes_of(mesh).corners, mesh.positions_m.size()) << seed;
  }
}

TEST(ConvexHull, OtherMeshesAreNot) {
  const TriangleMesh box = make_box({1.0, 1.0, 1.0});
  EXPECT_FALSE(convex_hull_of(make_rectangle(1.0, 1.0))) << "it is open";
  EXPECT_FALSE(convex_hull_of(together(box, displaced(box, {3.0f, 0.0f, 0.0f})))) << "two bodies";
  EXPECT_FALSE(convex_hull_of(together(box, inside_out(make_box({0.5, 0.5, 0.5}))))) << "hollow";
  TriangleMesh open = box;
  open.triangles.pop_back();
  EXPECT_FALSE(convex_hull_of(open));
  TriangleMesh dented = subdivided(make_sphere(1.0, 2));
  dented.positions_m[3] *= 0.98f;
  EXPECT_FALSE(convex_hull_of(dented));
}

TEST(ConvexParts, AreThePiecesOfAMesh) {
  const TriangleMesh box = make_box({1.0, 1.0, 1.0});
  const TriangleMesh two = together(box, displaced(make_sphere(0.4, 1), {3.0f, 0.0f, 0.0f}));
  const ConvexParts parts = convex_parts_of(two);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].faces.size(), 6u);
  EXPECT_EQ(parts[1].faces.size(), 80u);
  EXPECT_EQ(*std::ranges::min_element(parts[1].face_triangles), 12u);
  EXPECT_EQ(*std::ranges::max_element(parts[1].face_triangles), 91u);
  EXPECT_EQ(convex_parts_of(box).size(), 1u);
  EXPECT_EQ(convex_parts_of(inside_out(two)).size(), 2u);
}

TEST(ConvexParts, AreNoneIfAPieceIsNotConvexOrIsAHole) {
  const TriangleMesh box = make_box({1.0, 1.0, 1.0});
  EXPECT_TRUE(convex_parts_of(together(box, inside_out(make_box({0.5, 0.5, 0.5})))).empty()) << "hollow";
  EXPECT_TRUE(
      convex_parts_of(together(box, displaced(make_rectangle(1.0, 1.0), {3.0f, 0.0f, 0.0f}))).empty());
  TriangleMesh many;
  for (int i = 0; i < 257; ++i)
    many = together(many, displaced(box, {2.0f * static_cast<float>(i), 0.0f, 0.0f}));
  EXPECT_TRUE(convex_parts_of(many).empty()) << "more than max_convex_parts";
}

/// A corner that is pushed in by ten times the tolerance is found, and one by a tenth of it is not.
TEST(ConvexHull, Tolerance) {
  const auto dented_by = [](double depth_m) {
    // The middle of the top lies below its border by the depth.
    TriangleMesh box = subdivided(make_box({1.0, 1.0, 1.0}));
    for (glm::vec3& p : box.positions_m) {
      if (p.z > 0.4f && std::abs(p.x) < 0.1f && std::abs(p.y) < 0.1f) p.z -= static_cast<float>(depth_m);
    }
    return convex_hull_of(box).has_value();
  };
  const double diagonal_m = std::sqrt(3.0);
  EXPECT_TRUE(dented_by(1e-6 * diagonal_m));
  EXPECT_FALSE(dented_by(1e-4 * diagonal_m));
}

}  // namespace
}  // namespace rtstdb
