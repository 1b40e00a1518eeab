// Which meshes are convex, and the corners and faces of their hulls.

#include <glm/ext/vector_float2.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "rtstdb/geometry/convex_parts.hpp"
#include "tests/support/concave_meshes.hpp"
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

TEST(ConvexHull, AnLIsNotConvexWhereverItIs) {
  for (const float off_m : {0.0f, 1.0f, 60.0f, 1e3f, 1e4f, 9e4f})
    EXPECT_FALSE(convex_hull_of(displaced(test::make_l_shape(2.0, 1.0, 1.0), {off_m, 0.5f * off_m, 0.0f})))
        << off_m;
  EXPECT_FALSE(convex_hull_of(displaced(test::make_l_shape(2.0, 1.0, 1.0), {60.0f, 0.0f, 0.0f})));
}

/// All corners are on the hull, and the surface is not.
TEST(ConvexHull, ATwistedPrismIsNotConvex) {
  const auto twisted = [](double turn_rad) {
    TriangleMesh mesh;
    for (const double z : {0.0, 1.0})
      for (int i = 0; i < 5; ++i)
        mesh.positions_m.emplace_back(std::cos(1.2566370614 * i + z * turn_rad),
                                      std::sin(1.2566370614 * i + z * turn_rad), z);
    for (std::uint32_t i = 0; i < 5; ++i) {
      const std::uint32_t k = (i + 1) % 5;
      mesh.triangles.insert(mesh.triangles.end(), {{i, k, k + 5}, {i, k + 5, i + 5}});
      if (i > 0 && i < 4) mesh.triangles.insert(mesh.triangles.end(), {{5, i + 5, i + 6}, {0, i + 1, i}});
    }
    return convex_hull_of(mesh).has_value();
  };
  EXPECT_TRUE(twisted(0.0));
  EXPECT_TRUE(twisted(-0.2)) << "its sides bulge";
  EXPECT_TRUE(twisted(1e-6));
  EXPECT_FALSE(twisted(1e-3));
  EXPECT_FALSE(twisted(0.2));
}

/// The sides of boxes that face each other are inside the hull, and so is a hole.
TEST(ConvexHull, FlatBodiesHaveNoHoleAndNoNotch) {
  const auto flat = [](TriangleMesh mesh) {
    for (std::size_t i = mesh.triangles.size(); i-- > 0;)
      mesh.triangles.emplace_back(mesh.triangles[i].x, mesh.triangles[i].z, mesh.triangles[i].y);
    return convex_hull_of(mesh).has_value();
  };
  TriangleMesh sheet = make_rectangle(2.0, 1.0);
  for (int i = 0; i < 4; ++i)
    sheet = subdivided(sheet);
  EXPECT_TRUE(flat(sheet));
  for (const std::size_t hole : {std::size_t{0}, std::size_t{100}, std::size_t{301}}) {
    TriangleMesh holed = sheet;
    holed.triangles.erase(holed.triangles.begin() + static_cast<std::ptrdiff_t>(hole));
    EXPECT_FALSE(flat(holed)) << hole;
  }
  EXPECT_FALSE(flat(together(sheet, displaced(sheet, {2.01f, 0.0f, 0.0f})))) << "two sheets";
  EXPECT_TRUE(flat(together(sheet, displaced(sheet, {2.0f, 0.0f, 0.0f})))) << "two that touch";
}

/// Rounding leaves few points of edges that are corners too.
TEST(ConvexHull, OfTurnedBoxesHaveHardlyMoreThanEightCorners) {
  std::mt19937_64 random(7331);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  TriangleMesh box = make_box({1.0, 2.0, 3.0});
  for (int i = 0; i < 3; ++i)
    box = subdivided(box);
  int plain = 0;
  for (int i = 0; i < 100; ++i) {
    const glm::dquat q =
        glm::normalize(glm::dquat(uniform(random), uniform(random), uniform(random), uniform(random)));
    const glm::dvec3 by = std::pow(10.0, 2.0 * uniform(random)) * glm::dvec3(uniform(random), 1.0, 0.5);
    TriangleMesh turned = box;
    for (glm::vec3& p : turned.positions_m)
      p = glm::vec3(by + q * glm::dvec3(p));
    const Sizes sizes = sizes_of(turned);
    EXPECT_GE(sizes.corners, 8u);
    EXPECT_LE(sizes.corners, 10u);
    plain += sizes == Sizes{8, 6} ? 1 : 0;
  }
  EXPECT_GT(plain, 75);
}

TEST(ConvexHull, BodiesOfManyCorners) {
  EXPECT_EQ(sizes_of(make_sphere(1.0, 5)), (Sizes{10242, 20480}));
  EXPECT_EQ(sizes_of(make_cylinder(1.0, 2.0, 256)), (Sizes{512, 258}));
  // Far from the origin, precision merges faces of a cylinder, and its corners with them.
  const auto far = convex_hull_of(displaced(make_cylinder(1.0, 2.0, 4096), {3000.0f, 0.0f, 0.0f}));
  ASSERT_TRUE(far);
  EXPECT_GT(far->corners_m.size(), 32u);
  EXPECT_LT(far->corners_m.size(), 2048u);
}

/// Five and six corners, of which hulls that merge faces within a share of the diagonal lose some.
TEST(ConvexHull, ThinHullsKeepTheirCorners) {
  std::mt19937_64 random(7330);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 2000; ++i) {
    std::vector<glm::vec3> points_m;
    const double thickness = std::pow(10.0, -2.0 + 2.0 * uniform(random));  // 10^-4 to 1
    const glm::dquat q = glm::normalize(glm::dquat(uniform(random), uniform(random), uniform(random), 1.0));
    for (int k = 0; k < 5 + i % 8; ++k) {
      const double angle = 3.14159265 * uniform(random);
      points_m.emplace_back(100.0 *
                            (q * glm::dvec3(std::cos(angle), std::sin(angle), thickness * uniform(random))));
    }
    const auto mesh = make_hull(points_m);
    ASSERT_TRUE(mesh) << mesh.error().message;
    const auto hull = convex_hull_of(mesh.value());
    ASSERT_TRUE(hull);
    // Points on a cylinder are all corners, but for those that nearly coincide or are in one plane.
    if (mesh.value().positions_m.size() != hull->corners_m.size()) {
      for (const glm::vec3& p : mesh.value().positions_m) {
        double nearest_m = 1e9;
        for (const glm::vec3& kept : hull->corners_m)
          nearest_m = std::min<double>(nearest_m, glm::distance(p, kept));
        EXPECT_LT(nearest_m, 1.0) << "a corner that is missing is near another one";
      }
    }
  }
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
