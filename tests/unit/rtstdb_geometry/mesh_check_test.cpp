#include <glm/vec3.hpp>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include <rtstdb/geometry.hpp>

namespace rtstdb {
namespace {

TriangleMesh two_triangles() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 2}}, {{0, 1, 2}, {0, 1, 3}}};
}

/// Refused with a message that has each part.
void expect_refused(const TriangleMesh& mesh, std::initializer_list<const char*> parts) {
  const Result<void> checked = validate(mesh);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::bad_input);
  for (const char* part : parts)
    EXPECT_NE(checked.error().message.find(part), std::string::npos)
        << checked.error().message << " lacks " << part;
}

TEST(Validate, RefusesAMeshWithNoTriangle) {
  expect_refused({}, {"no triangle"});
  TriangleMesh points = two_triangles();
  points.triangles.clear();
  expect_refused(points, {"no triangle"});
}

TEST(Validate, NamesTheTriangleWithAnIndexBeyondThePositions) {
  TriangleMesh mesh = two_triangles();
  EXPECT_TRUE(validate(mesh).ok());
  mesh.triangles[1].z = 4;
  expect_refused(mesh, {"triangle 1", "index 4", "the count of positions is 4"});
}

TEST(Validate, NamesTheTriangleAndItsValues) {
  TriangleMesh mesh = two_triangles();
  mesh.positions_m[3].y = std::numeric_limits<float>::quiet_NaN();
  expect_refused(mesh, {"triangle 1", "corner 3", "nan", "not finite"});
  mesh.positions_m[3].y = -std::numeric_limits<float>::infinity();
  expect_refused(mesh, {"triangle 1", "-inf", "not finite"});
  mesh.positions_m[3].y = 1.25e6f;
  expect_refused(mesh, {"triangle 1", "1250000", "beyond the limit of 100000 m"});
  mesh.positions_m[3].y = -1e5f;
  EXPECT_TRUE(validate(mesh).ok());
}

TEST(Validate, ChecksUnusedPositionsToo) {
  TriangleMesh mesh = two_triangles();
  mesh.positions_m.emplace_back(0.0f, 0.0f, std::numeric_limits<float>::quiet_NaN());
  expect_refused(mesh, {"position 4", "no triangle uses", "not finite"});
}

TEST(Validate, RefusesMeshesWithOnlyDegenerateTriangles) {
  TriangleMesh mesh = two_triangles();
  mesh.triangles[0] = {1, 1, 2};
  EXPECT_TRUE(validate(mesh).ok());
  mesh.triangles[1] = {0, 3, 3};
  expect_refused(mesh, {"every triangle (count 2) is degenerate"});
  const TriangleMesh on_one_line{{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}}, {{0, 1, 2}}};
  expect_refused(on_one_line, {"degenerate", "(2, 4, 6)"});
  // A thin triangle is not degenerate.
  const TriangleMesh sliver{{{0, 0, 0}, {1, 0, 0}, {0, 1e-30f, 0}}, {{0, 1, 2}}};
  EXPECT_TRUE(validate(sliver).ok());
}

TEST(BoundsOf, HoldsUsedPositionsOnly) {
  TriangleMesh mesh = two_triangles();
  mesh.positions_m.emplace_back(50.0f, 50.0f, 50.0f);
  mesh.positions_m[1].x = -3.0f;
  const Bounds bounds = bounds_of(mesh);
  EXPECT_EQ(bounds.minimum_m, glm::vec3(-3.0f, 0.0f, 0.0f));
  EXPECT_EQ(bounds.maximum_m, glm::vec3(0.0f, 1.0f, 2.0f));
}

TEST(BoundsOfDeathTest, OfNothingIsMisuse) {
  EXPECT_DEATH(bounds_of({}), "rtstdb was misused");
}

TEST(Validate, NamesTheTriangleAndItsCornerNormal) {
  TriangleMesh mesh = two_triangles();
  const glm::vec3 up(0, 0, 1);
  mesh.corner_normals = {{up, up, up}};
  expect_refused(mesh, {"corner normals for 1 triangles", "the count of its triangles is 2"});
  mesh.corner_normals.push_back({up, 1e-45f * up, 3e38f * up});
  EXPECT_TRUE(validate(mesh).ok()) << "any length but zero";
  mesh.corner_normals[1][2] = glm::vec3(0, -0.0f, 0);
  expect_refused(mesh, {"triangle 1", "corner 2", "normal (0, -0, 0)", "of length zero"});
  mesh.corner_normals[1][2].y = std::numeric_limits<float>::quiet_NaN();
  expect_refused(mesh, {"triangle 1", "corner 2", "nan", "not finite"});
  mesh.corner_normals.resize(3, {up, up, up});
  expect_refused(mesh, {"corner normals for 3 triangles"});
}

TEST(Validate, NamesTheTriangleAndItsCornerColour) {
  TriangleMesh mesh = two_triangles();
  const glm::vec3 white(1, 1, 1);
  mesh.corner_colors = {{white, white, white}};
  expect_refused(mesh, {"corner colours for 1 triangles", "the count of its triangles is 2"});
  mesh.corner_colors.push_back({white, glm::vec3(0), glm::vec3(0, 1, 0.5f)});
  EXPECT_TRUE(validate(mesh).ok());
  for (const float wrong : {-1e-6f, 1.0001f}) {
    mesh.corner_colors[0][1].z = wrong;
    expect_refused(mesh, {"triangle 0", "corner 1", "colour (1, 1, ", "outside 0 to 1"});
  }
  mesh.corner_colors[0][1].z = std::numeric_limits<float>::infinity();
  expect_refused(mesh, {"triangle 0", "corner 1", "inf", "not finite"});
}

}  // namespace
}  // namespace rtstdb
