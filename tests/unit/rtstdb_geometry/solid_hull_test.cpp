// Solids: which meshes they are accepted for, and their hulls.

#include "rtstdb/geometry/solid_hull.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include <rtstdb/limits.hpp>

namespace rtstdb {
namespace {

constexpr Solid ball{.kind = SolidKind::sphere, .radius_m = 1.0};
constexpr Solid drum{.kind = SolidKind::cylinder, .radius_m = 0.5, .height_m = 0.2};

void expect_refused(const TriangleMesh& mesh, const Solid& solid, const std::string& text) {
  const auto hull = solid_hull(mesh, solid);
  ASSERT_FALSE(hull.ok());
  EXPECT_EQ(hull.error().code, ErrorCode::bad_input);
  EXPECT_NE(hull.error().message.find(text), std::string::npos) << hull.error().message;
}

TEST(SolidHull, OfASphereIsAPointAndABall) {
  const auto hull = solid_hull(make_sphere(1.0), ball);
  ASSERT_TRUE(hull) << hull.error().message;
  ASSERT_TRUE(hull.value().round);
  EXPECT_EQ(hull.value().round->core_corners, 1u);
  EXPECT_EQ(hull.value().round->radius_m, 1.0f);
  EXPECT_EQ(hull.value().round->axis, glm::vec3(0.0f));
  EXPECT_TRUE(hull.value().faces.empty());
  EXPECT_EQ(hull.value().face_triangles.size(), make_sphere(1.0).triangles.size());
}

TEST(SolidHull, OfACylinderHasTwoCaps) {
  const auto hull = solid_hull(make_cylinder(0.5, 0.2), drum);
  ASSERT_TRUE(hull) << hull.error().message;
  ASSERT_TRUE(hull.value().round);
  EXPECT_EQ(hull.value().round->core_corners, 2u);
  EXPECT_EQ(hull.value().round->axis, glm::vec3(0.0f, 0.0f, 1.0f));
  ASSERT_EQ(hull.value().faces.size(), 2u);
  for (const ConvexHull::Face& face : hull.value().faces) {
    glm::vec3 around(0.0f);
    for (std::uint32_t i = 0; i < face.corner_count; ++i) {
      const glm::vec3 from = hull.value().corners_m[hull.value().face_corners[face.first_corner + i]];
      const glm::vec3 to =
          hull.value().corners_m[hull.value().face_corners[face.first_corner + (i + 1) % face.corner_count]];
      EXPECT_NEAR(from.z, 0.1f * face.normal.z, 1e-6f);
      EXPECT_NEAR(glm::length(glm::vec2(from)), 0.5f, 1e-6f);
      around += glm::cross(from, to);
    }
    EXPECT_GT(glm::dot(around, face.normal), 0.0f);  // counter-clockwise from outside
  }
}

TEST(SolidHull, MayBeMovedAndTurned) {
  Solid turned = drum;
  turned.center_m = {1.0, 2.0, 3.0};
  turned.q_entity = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, -1.0)));
  TriangleMesh mesh = make_cylinder(0.5, 0.2);
  expect_refused(mesh, turned, "the cylinder is");
  for (glm::vec3& p_m : mesh.positions_m)
    p_m = glm::vec3(turned.center_m + turned.q_entity * glm::dvec3(p_m));
  EXPECT_TRUE(solid_hull(mesh, turned).ok());
}

TEST(SolidHull, OfABoxHasItsFaces) {
  const auto hull =
      solid_hull(make_box({1.0, 2.0, 3.0}), {.kind = SolidKind::box, .size_m = {1.0, 2.0, 3.0}});
  ASSERT_TRUE(hull) << hull.error().message;
  EXPECT_FALSE(hull.value().round);
  EXPECT_EQ(hull.value().corners_m.size(), 8u);
  EXPECT_EQ(hull.value().faces.size(), 6u);
}

/// A mesh may be off by 2 % of the diagonal of its box.
TEST(SolidHull, RefusesAMeshThatDeviates) {
  Solid larger = ball;
  larger.radius_m = 1.06;
  EXPECT_TRUE(solid_hull(make_sphere(1.0), larger).ok());
  larger.radius_m = 1.08;
  expect_refused(make_sphere(1.0), larger, "off the mesh at the mesh's point");
  expect_refused(make_sphere(1.0), larger, "at most 0.0692");
  expect_refused(make_box({1.0, 1.0, 1.0}), {.kind = SolidKind::sphere, .radius_m = 0.6}, "off the mesh");
  expect_refused(make_cylinder(0.5, 1.0), {.kind = SolidKind::capsule, .radius_m = 0.5, .height_m = 0.5},
                 "off the mesh");
}

/// All of the mesh lies on the sphere, but half of the sphere is missing.
TEST(SolidHull, RefusesAMeshThatIsAPartOfTheSolid) {
  TriangleMesh half = make_sphere(1.0);
  std::erase_if(half.triangles, [&](const glm::uvec3& t) {
    return half.positions_m[t.x].z + half.positions_m[t.y].z + half.positions_m[t.z].z < 0.0f;
  });
  expect_refused(half, ball, "off the mesh at its point");
}

TEST(SolidHull, RefusesSizesThatAreNone) {
  const TriangleMesh sphere = make_sphere(1.0);
  expect_refused(sphere, {.kind = static_cast<SolidKind>(9), .radius_m = 1.0},
                 "has the kind 9, which is none of the enumerators");
  expect_refused(sphere, {.kind = SolidKind::sphere}, "has the radius 0 m");
  expect_refused(sphere, {.kind = SolidKind::sphere, .radius_m = -1.0}, "has the radius -1 m");
  expect_refused(sphere, {.kind = SolidKind::cylinder, .radius_m = 1.0}, "has the height 0 m");
  expect_refused(sphere, {.kind = SolidKind::box, .size_m = {1.0, 0.0, 1.0}}, "has the size (1, 0, 1)");
  expect_refused(sphere, {.kind = SolidKind::sphere, .radius_m = std::numeric_limits<double>::infinity()},
                 "has the radius inf");
  Solid bad = ball;
  bad.center_m.x = std::numeric_limits<double>::quiet_NaN();
  expect_refused(sphere, bad, "which is not finite");
  bad = ball;
  bad.q_entity = glm::dquat(2.0, 0.0, 0.0, 0.0);
  expect_refused(sphere, bad, "not of length 1");
}

TEST(SolidHull, ExtendsTheBoundsOfTheMesh) {
  const TriangleMesh mesh = make_sphere(1.0);
  const ConvexParts parts{solid_hull(mesh, ball).value()};
  const Bounds bounds = bounds_of(with_points_of_parts(mesh, parts));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(bounds.maximum_m[axis], 1.0f, 1e-5f);
    EXPECT_GE(bounds.maximum_m[axis], 1.0f);
    EXPECT_LE(bounds.minimum_m[axis], -1.0f);
  }
}

}  // namespace
}  // namespace rtstdb
