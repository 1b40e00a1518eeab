// Convex parts that the caller gives.

#include "rtstdb/geometry/given_parts.hpp"

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include <rtstdb/limits.hpp>

#include "tests/support/concave_meshes.hpp"

namespace rtstdb {
namespace {

std::vector<glm::vec3> box_corners(const glm::vec3& center_m, const glm::vec3& size_m) {
  std::vector<glm::vec3> corners = make_box(glm::dvec3(size_m)).positions_m;
  for (glm::vec3& corner : corners)
    corner += center_m;
  return corners;
}

/// A box as the shape, and two halves of it as its parts.
struct Halves {
  TriangleMesh mesh = make_box({2.0, 1.0, 1.0});
  ConvexPartPoints parts_m{box_corners({-0.5f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f}),
                           box_corners({0.5f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f})};

  Result<ConvexParts> convex_parts() const {
    return given_convex_parts({mesh.positions_m, mesh.triangles}, parts_m);
  }
  void expect_refused(const std::string& text) const {
    const auto result = convex_parts();
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::bad_input);
    EXPECT_NE(result.error().message.find(text), std::string::npos) << result.error().message;
  }
};

TEST(GivenParts, HaveHullsAndTrianglesOfTheMesh) {
  const auto parts = Halves{}.convex_parts();
  ASSERT_TRUE(parts) << parts.error().message;
  ASSERT_EQ(parts.value().size(), 2u);
  for (const ConvexHull& hull : parts.value()) {
    EXPECT_EQ(hull.corners_m.size(), 8u);
    EXPECT_EQ(hull.faces.size(), 6u);
    for (const ConvexHull::Face& face : hull.faces) {
      ASSERT_GE(face.triangle_count, 1u);
      for (std::uint32_t i = 0; i < face.triangle_count; ++i)
        EXPECT_LT(hull.face_triangles[face.first_triangle + i], 12u);
    }
  }
  EXPECT_NEAR(parts.value()[0].center_m.x, -0.5f, 1e-6f);
}

TEST(GivenParts, WrongOnesAreRefusedWithTheirValues) {
  Halves flat;
  flat.parts_m[1].resize(4);
  for (glm::vec3& p : flat.parts_m[1])
    p.z = 0.0f;
  flat.expect_refused("convex part 1 has 4 points that are too thin: they are 0 m thick, and at least ");
  Halves few;
  few.parts_m[0].resize(3);
  few.expect_refused("convex part 0 has 3 points");
  Halves endless;
  endless.parts_m[0][2].y = std::numeric_limits<float>::quiet_NaN();
  endless.expect_refused("convex part 0 has the point (");
  Halves beyond;
  beyond.parts_m[1].emplace_back(1.5f, 0.0f, 0.0f);
  beyond.expect_refused(
      "convex part 1 has the point (1.5, 0, 0), which is 0.5 m outside the box of the mesh");
  Halves millimetres;
  for (glm::vec3& p : millimetres.parts_m[0])
    p *= 1000.0f;
  millimetres.expect_refused("which is 999 m outside the box of the mesh; at most 0.1225 m are allowed");
  Halves half;
  half.parts_m.pop_back();
  half.expect_refused(" m outside all convex parts; at most 0.1225 m are allowed");
  Halves many;
  many.parts_m.resize(max_convex_parts + 1, many.parts_m[0]);
  many.expect_refused("257 convex parts");
  Halves large;
  large.parts_m[0].resize(max_convex_part_points + 1);
  large.expect_refused("1025 points");
}

/// A mesh and its own corners, in any order and more than once, as its only part.
void expect_accepted(const TriangleMesh& mesh, std::size_t corners) {
  ConvexPartPoints parts_m{mesh.positions_m};
  parts_m[0].insert(parts_m[0].end(), mesh.positions_m.rbegin(), mesh.positions_m.rend());
  const auto parts = given_convex_parts(mesh, parts_m);
  ASSERT_TRUE(parts) << parts.error().message;
  EXPECT_EQ(parts.value()[0].corners_m.size(), corners);
  const auto recovered = recovered_convex_parts(mesh, parts_m);
  EXPECT_EQ(recovered.at(0).corners_m, parts.value()[0].corners_m);
  EXPECT_EQ(recovered.at(0).face_triangles, parts.value()[0].face_triangles);
}

TEST(GivenParts, WhatHasAHullIsAccepted) {
  std::mt19937_64 random(7320);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 300; ++i) {
    const glm::dquat q =
        glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random)));
    SCOPED_TRACE(i);
    // Cubes, rods of 4 m by 3 mm, plates of 1 mm.
    TriangleMesh mesh = i % 3 == 0   ? make_box({1.0, 1.0, 1.0})
                        : i % 3 == 1 ? make_box({4.0, 3e-3, 3e-3})
                                     : make_box({1.0, 2.0, 1e-3});
    for (glm::vec3& p : mesh.positions_m)
      p = glm::vec3(q * glm::dvec3(p));
    expect_accepted(mesh, 8);
  }
  const TriangleMesh sphere = make_sphere(1.0, 1);
  expect_accepted(sphere, 42);
}

/// A log may hold what is refused now: points of less thickness, and parts that do not fit the mesh.
TEST(GivenParts, OfALogAreNeverRefused) {
  Halves thin;
  thin.mesh = make_box({1.0, 1.0, 0.01});
  for (glm::vec3& p : thin.mesh.positions_m)
    p += glm::vec3(9e4f, 0.0f, 0.0f);
  thin.parts_m = {thin.mesh.positions_m};
  thin.expect_refused("convex part 0 has 8 points that are too thin");
  const auto hulls = recovered_convex_parts(thin.mesh, thin.parts_m);
  ASSERT_EQ(hulls.size(), 1u);
  EXPECT_EQ(hulls[0].faces.size(), 2u) << "a flat hull";
  EXPECT_EQ(hulls[0].corners_m.size(), 4u);
  Halves other;
  other.parts_m.pop_back();
  other.expect_refused("outside all convex parts");
  EXPECT_EQ(recovered_convex_parts(other.mesh, other.parts_m).size(), 1u);
  Halves line;
  line.parts_m = {{{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.5f, 0.0f, 0.0f}, {0.25f, 0.0f, 0.0f}}};
  line.expect_refused("are too thin");
  const auto of_mesh = recovered_convex_parts(line.mesh, line.parts_m);
  ASSERT_EQ(of_mesh.size(), 1u);
  EXPECT_EQ(of_mesh[0].corners_m.size(), 8u) << "the hull of the mesh";
}

/// The corners of the mesh lie in the parts, and those of the parts on the mesh.
TEST(GivenParts, PartsThatLeaveAGapInALargeFaceAreRefused) {
  Halves ends;
  ends.parts_m = {box_corners({-0.75f, 0.0f, 0.0f}, {0.5f, 1.0f, 1.0f}),
                  box_corners({0.75f, 0.0f, 0.0f}, {0.5f, 1.0f, 1.0f})};
  ends.expect_refused(" m outside all convex parts; at most 0.1225 m are allowed");
}

/// An L, and the hull of its corners, or two parts that leave its corner open inside.
TEST(GivenParts, APartThatFillsACavityIsRefused) {
  Halves angle;
  angle.mesh = test::make_l_shape(1.0, 0.3, 0.4);
  const std::vector<glm::vec3> arms[] = {box_corners({0.5f, 0.15f, 0.2f}, {1.0f, 0.3f, 0.4f}),
                                         box_corners({0.15f, 0.65f, 0.2f}, {0.3f, 0.7f, 0.4f})};
  angle.parts_m = {arms[0], arms[1]};
  ASSERT_TRUE(angle.convex_parts()) << angle.convex_parts().error().message;
  angle.parts_m = {arms[0], box_corners({0.15f, 0.69f, 0.2f}, {0.3f, 0.62f, 0.4f})};
  EXPECT_TRUE(angle.convex_parts()) << "a gap of 8 cm inside the body";
  angle.parts_m = {angle.mesh.positions_m};
  angle.expect_refused("convex part 0 has the point (");
  // Two equal parts do not hide each other.
  angle.parts_m = {angle.mesh.positions_m, angle.mesh.positions_m};
  angle.expect_refused("outside the mesh; at most 0.07348 m are allowed");
}

TEST(GivenParts, PiecesOfAMesh) {
  TriangleMesh pieces;
  for (const float x : {-0.5f, 0.5f}) {
    const TriangleMesh box = make_box({1.0, 1.0, 1.0});
    const auto first = static_cast<std::uint32_t>(pieces.positions_m.size());
    for (const glm::vec3& p : box.positions_m)
      pieces.positions_m.push_back(p + glm::vec3(x, 0.0f, 0.0f));
    for (const glm::uvec3& triangle : box.triangles)
      pieces.triangles.push_back(triangle + first);
  }
  const ConvexPartPoints corners_m = pieces_of(pieces);
  ASSERT_EQ(corners_m.size(), 2u);
  EXPECT_EQ(corners_m[0].size(), 8u);
  EXPECT_EQ(corners_m[1].size(), 8u);
}

}  // namespace
}  // namespace rtstdb
