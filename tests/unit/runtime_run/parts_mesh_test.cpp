// Shapes made of parts: closed, with their fronts outside, and where they belong.

#include "runtime/run/parts_mesh.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace hil::run {
namespace {

constexpr double pi = std::numbers::pi;

rtstdb::TriangleMesh mesh_of(const config::Part& part) {
  return mesh_of_parts(std::span(&part, 1));
}

/// Positive when fronts are outside.
double volume_m3(const rtstdb::TriangleMesh& mesh) {
  double six_times = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions_m[t.x]), b(mesh.positions_m[t.y]), c(mesh.positions_m[t.z]);
    six_times += glm::dot(a, glm::cross(b, c));
  }
  return six_times / 6.0;
}

/// Each edge is used by two triangles, in opposite directions.
bool is_closed(const rtstdb::TriangleMesh& mesh) {
  std::map<std::pair<glm::uint, glm::uint>, int> edges;
  for (const glm::uvec3& t : mesh.triangles) {
    ++edges[{t.x, t.y}];
    ++edges[{t.y, t.z}];
    ++edges[{t.z, t.x}];
  }
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (count != 1 || back == edges.end() || back->second != 1) return false;
  }
  return true;
}

TEST(PartsMesh, EachBodyIsClosedWithItsFrontsOutside) {
  const std::pair<config::PartBody, double> bodies[] = {
      {config::BoxPart{{1.0, 2.0, 3.0}}, 6.0},
      {config::ConePart{1.0, 1.0, 2.0, 512}, 2.0 * pi},
      {config::ConePart{1.0, 0.5, 2.0, 512}, 2.0 * pi / 3.0 * (1.0 + 0.5 + 0.25)},
      {config::ConePart{1.0, 0.0, 3.0, 512}, pi},
      {config::SpherePart{1.0, 5}, 4.0 / 3.0 * pi},
      {config::RingPart{2.0, 0.5, 256, 128}, 2.0 * pi * pi * 2.0 * 0.25}};
  for (const auto& [body, volume] : bodies) {
    const config::Part part{.body = body, .repeat = {}};
    const rtstdb::TriangleMesh mesh = mesh_of(part);
    EXPECT_TRUE(is_closed(mesh)) << "body " << body.index();
    EXPECT_NEAR(volume_m3(mesh), volume, 2e-3 * volume) << "body " << body.index();
    EXPECT_EQ(mesh.triangles.size(), config::triangles_of(part)) << "body " << body.index();
    EXPECT_TRUE(rtstdb::validate(mesh));
  }
}

TEST(PartsMesh, PartIsPlacedThenRepeated) {
  // A box whose copies stand at 1 m, 2 m and 3 m on the x axis, and then in four directions around z, each
  // row 10 m above the one before.
  const config::Part part{
      .body = config::BoxPart{{0.1, 0.2, 0.4}},
      .position_m = {1.0, 0.0, 0.0},
      .repeat = {{.count = 3, .step_m = {1.0, 0.0, 0.0}},
                 {.count = 4, .step_m = {0.0, 0.0, 10.0}, .turn_rad = pi / 2.0, .axis = 2}}};
  const rtstdb::TriangleMesh mesh = mesh_of(part);
  ASSERT_EQ(mesh.triangles.size(), 12U * 12U);
  const std::size_t corners = mesh.positions_m.size() / 12;
  const glm::dvec3 directions[] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {-1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}};
  // The first repeat's copies are repeated one after the other.
  for (std::size_t copy = 0; copy < 12; ++copy) {
    glm::dvec3 middle(0.0);
    for (std::size_t i = 0; i < corners; ++i)
      middle += glm::dvec3(mesh.positions_m[copy * corners + i]) / static_cast<double>(corners);
    const std::size_t row = copy / 4, around = copy % 4;
    const glm::dvec3 expected = directions[around] * static_cast<double>(row + 1) +
                                glm::dvec3(0.0, 0.0, 10.0 * static_cast<double>(around));
    EXPECT_LT(glm::length(middle - expected), 1e-6) << "copy " << copy;
  }
}

TEST(PartsMesh, ColorsAreThoseOfTheParts) {
  const config::Part plain{.body = config::BoxPart{{1.0, 1.0, 1.0}}, .repeat = {}};
  EXPECT_TRUE(mesh_of(plain).corner_colors.empty());
  const config::Part blue{.body = config::BoxPart{{1.0, 1.0, 1.0}},
                          .color = {0.0, 0.25, 1.0},
                          .repeat = {{.count = 2, .step_m = {2.0, 0.0, 0.0}}}};
  const config::Part parts[] = {plain, blue};
  const rtstdb::TriangleMesh mesh = mesh_of_parts(parts);
  ASSERT_EQ(mesh.corner_colors.size(), 36U);
  EXPECT_EQ(mesh.corner_colors[11][2], glm::vec3(1.0f));
  EXPECT_EQ(mesh.corner_colors[12][0], glm::vec3(0.0f, 0.25f, 1.0f));
  EXPECT_EQ(mesh.corner_colors[35][1], glm::vec3(0.0f, 0.25f, 1.0f));
  EXPECT_TRUE(rtstdb::validate(mesh));
}

TEST(PartsMesh, RotationTurnsThePartItself) {
  const double half = std::sqrt(0.5);
  const config::Part part{.body = config::ConePart{1.0, 0.0, 4.0, 16},
                          .position_m = {0.0, 5.0, 0.0},
                          .rotation_wxyz = {half, -half, 0.0, 0.0},  // z to y
                          .repeat = {}};
  const rtstdb::Bounds bounds = rtstdb::bounds_of(mesh_of(part));
  EXPECT_NEAR(bounds.minimum_m.y, 3.0, 1e-6);
  EXPECT_NEAR(bounds.maximum_m.y, 7.0, 1e-6);
  EXPECT_NEAR(bounds.maximum_m.z, 1.0, 1e-6);
}

}  // namespace
}  // namespace hil::run
