// Fields of meshes, built from the oracle's distances, against these distances.

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/support/field_meshes.hpp"

namespace rtstdb::field {
namespace {

using test::build_with_oracle;
using test::make_plate_with_hole;
using test::make_small_station;
using test::make_torus;

double diagonal_m(const TriangleMesh& mesh) {
  const Bounds box = bounds_of(mesh);
  return glm::distance(glm::dvec3(box.minimum_m), glm::dvec3(box.maximum_m));
}

struct Case {
  const char* name;
  TriangleMesh mesh;
  bool is_closed;
};

std::vector<Case> cases() {
  return {{"sphere", make_sphere(2.0, 3), true},
          {"torus", make_torus(3.0, 0.8, 24), true},
          {"plate_with_hole", make_plate_with_hole(4.0, 1.5, 0.6), true},
          {"box", make_box({1.0, 2.0, 3.0}), true},
          {"station", make_small_station(), true},
          {"rectangle", make_rectangle(2.0, 3.0), false}};
}

class Fields : public testing::TestWithParam<Case> {};

TEST_P(Fields, HaveTheWantedErrorAndTheRightSigns) {
  const TriangleMesh& mesh = GetParam().mesh;
  const oracle::MeshDistance distance(mesh);
  auto built = build_with_oracle(mesh, distance, {});
  ASSERT_TRUE(built.ok()) << built.error().message;
  const StoredField& field = built.value();
  const FieldReport& report = field.report;
  const double wanted_m = diagonal_m(mesh) / 500.0;
  EXPECT_LE(report.error_p99_m, wanted_m);
  EXPECT_LE(report.error_max_m, 0.6 * report.cell_m);
  EXPECT_LE(report.attempts, 3u) << "the cells of an attempt follow from the error of the one before it";
  EXPECT_EQ(report.sign, GetParam().is_closed ? FieldSign::winding : FieldSign::none);
  EXPECT_EQ(report.bytes, 16 * device_texels(field, 0).size());
  EXPECT_LE(report.bytes, FieldOptions{}.max_bytes);
  EXPECT_EQ(field.is_signed, GetParam().is_closed);

  // Points of another random sequence, evenly spread; and as many near the surface, most of them near edges.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const glm::dvec3 low(field.grid.origin_m);
  const glm::dvec3 size = static_cast<double>(field.grid.cell_m) * glm::dvec3(field.grid.cells);
  std::vector<double> errors_m;
  std::size_t inside = 0, outside = 0;
  for (int i = 0; i < 6000; ++i) {
    glm::dvec3 point_m = low + size * glm::dvec3(uniform(random), uniform(random), uniform(random));
    if (i % 2 == 0) {
      const glm::dvec3 towards = distance.nearest(point_m).point_m;
      point_m = glm::mix(towards, point_m, 0.3 * uniform(random));
    }
    const double truth_m = distance.nearest(point_m).distance_m;
    EXPECT_LT(std::abs(field.distance_m(point_m) - truth_m), 0.6 * field.cell_at(point_m).edge_m);
    if (i % 2 != 0 && field.is_in_brick(point_m))
      errors_m.push_back(std::abs(field.distance_m(point_m) - truth_m));
    if (!field.is_signed || truth_m <= report.cell_m) continue;
    const bool is_inside = distance.is_inside(point_m);
    ++(is_inside ? inside : outside);
    EXPECT_EQ(field.signed_distance_m(point_m) < 0.0, is_inside)
        << point_m.x << ", " << point_m.y << ", " << point_m.z << ": " << truth_m;
  }
  std::ranges::sort(errors_m);
  ASSERT_GT(errors_m.size(), 500u);
  EXPECT_LE(errors_m[errors_m.size() * 98 / 100], wanted_m);
  if (field.is_signed) {
    EXPECT_GT(inside, 5u);
    EXPECT_GT(outside, 200u);
  }
}

/// Thousands of cells along one axis.
TEST(LongFields, CoverTheWholeGeometry) {
  const TriangleMesh mesh = make_box({20.0, 0.002, 0.002});
  const oracle::MeshDistance distance(mesh);
  auto built = build_with_oracle(mesh, distance, {.cell_m = 0.0015});
  ASSERT_TRUE(built.ok()) << built.error().message;
  const Grid& grid = built.value().grid;
  EXPECT_GT(grid.cells.x, 2500u);
  EXPECT_LT(grid.origin_m.x, -10.0f);
  EXPECT_GT(grid.origin_m.x + grid.cell_m * static_cast<float>(grid.cells.x), 10.0f);
  for (const double end_m : {-10.0, 10.0})
    EXPECT_NEAR(built.value().distance_m({end_m, 0.0, 0.0}), 0.0, 0.001);
}

INSTANTIATE_TEST_SUITE_P(Meshes, Fields, testing::ValuesIn(cases()),
                         [](const auto& one) { return std::string(one.param.name); });

/// The field does not depend on the parts in which distances are computed.
TEST(FieldBuild, IsTheSameInAnyParts) {
  const TriangleMesh mesh = make_box({1.0, 2.0, 3.0});
  const oracle::MeshDistance distance(mesh);
  const auto whole = build_with_oracle(mesh, distance, {.cell_m = 0.1}, 1 << 20);
  const auto parts = build_with_oracle(mesh, distance, {.cell_m = 0.1}, 77);
  ASSERT_TRUE(whole.ok() && parts.ok());
  EXPECT_EQ(device_texels(whole.value(), 5), device_texels(parts.value(), 5));
  EXPECT_EQ(whole.value().report.distances, parts.value().report.distances);
  EXPECT_EQ(whole.value().report.attempts, 1u);
  EXPECT_NEAR(whole.value().report.cell_m, 0.1, 1e-7);
}

/// Where every brick is: no part of the surface is in a cell without one, nor within a cell of a brick.
TEST(FieldBuild, HasBricksAllAlongTheSurface) {
  const TriangleMesh mesh = make_torus(3.0, 0.8, 24);
  const oracle::MeshDistance distance(mesh);
  const auto built = build_with_oracle(mesh, distance, {.cell_m = 0.1});
  ASSERT_TRUE(built.ok());
  const StoredField& field = built.value();
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 20'000; ++i) {
    const glm::dvec3 point_m(4.0 * uniform(random), 4.0 * uniform(random), uniform(random));
    if (distance.nearest(point_m).distance_m < 0.1) {
      ASSERT_TRUE(field.is_in_brick(point_m)) << point_m.x << ", " << point_m.y << ", " << point_m.z;
    }
  }
  EXPECT_LT(3 * field.report.bricks, 2 * field.report.coarse_cells);
}

TEST(FieldBuild, ShowsItsProgress) {
  const TriangleMesh mesh = make_box({1.0, 2.0, 3.0});
  auto begun = FieldBuild::begin(bounds_of(mesh), true, {.cell_m = 0.2});
  ASSERT_TRUE(begun.ok());
  FieldBuild build = std::move(begun).value();
  const oracle::MeshDistance distance(mesh);
  std::vector<shared::FieldPoint> points(500);
  std::uint64_t before = 0;
  FieldProgress progress;
  std::vector<FieldProgress> reports;
  while (const std::size_t count = build.next(points)) {
    std::vector<shared::FieldSample> samples;
    for (const auto& point : std::span(points).first(count))
      samples.push_back(
          {{1.0f, 0.0f, 0.0f}, static_cast<float>(distance.nearest(glm::dvec3(point.point_m)).distance_m)});
    ASSERT_TRUE(build.take(samples).ok());
    progress = build.progress();
    EXPECT_EQ(progress.distances, before + count);
    EXPECT_GE(progress.expected, progress.distances);
    before = progress.distances;
    reports.push_back(progress);
  }
  EXPECT_EQ(progress.expected, progress.distances);
  // When the cells that need a brick are known, so is the number of distances.
  const StoredField field = std::move(build).field();
  const std::uint64_t known_from = field.grid.vertex_count() + field.grid.cell_count();
  for (const FieldProgress& one : reports) {
    if (one.distances < known_from) continue;
    EXPECT_EQ(one.expected, progress.distances) << "after " << one.distances;
  }
}

TEST(FieldBuild, RefusesWhatDoesNotFitWithBothNumbers) {
  const TriangleMesh mesh = make_box({1.0, 2.0, 3.0});
  const oracle::MeshDistance distance(mesh);
  const auto refused = build_with_oracle(mesh, distance, {.cell_m = 0.05, .max_bytes = 100'000});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::capacity);
  EXPECT_NE(refused.error().message.find("max_bytes is 100000"), std::string::npos)
      << refused.error().message;
  EXPECT_NE(refused.error().message.find("cells of 0.05 m"), std::string::npos) << refused.error().message;

  // After an attempt that fits but is not precise enough, the text has the error of this attempt.
  const auto short_of = build_with_oracle(mesh, distance, {.error_m = 1e-4, .max_bytes = 2'000'000});
  ASSERT_FALSE(short_of.ok());
  EXPECT_EQ(short_of.error().code, ErrorCode::capacity);
  EXPECT_NE(short_of.error().message.find("had an error of"), std::string::npos) << short_of.error().message;
  EXPECT_NE(short_of.error().message.find("0.0001 m is wanted"), std::string::npos)
      << short_of.error().message;

  // Too many cells for any memory: refused before the first distance.
  EXPECT_FALSE(FieldBuild::begin(bounds_of(mesh), true, {.cell_m = 1e-5}).ok());
}

TEST(FieldBuild, RefusesTheWindingOfAnOpenMesh) {
  const auto refused =
      FieldBuild::begin({{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 0.0f}}, false, {.sign = FieldSign::winding});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_NE(refused.error().message.find("winding needs a closed geometry"), std::string::npos);
}

TEST(FieldOptionsCheck, RefusesValuesWithTheirLimits) {
  const auto message = [](const FieldOptions& options) {
    const auto checked = check_field_options(options);
    return checked ? std::string() : checked.error().message;
  };
  EXPECT_EQ(message({}), "");
  EXPECT_EQ(message({.error_m = 0.01}), "");
  EXPECT_NE(message({.error_m = -0.5}).find("error_m is -0.5 m"), std::string::npos);
  EXPECT_NE(message({.cell_m = std::nan("")}).find("cell_m is nan m"), std::string::npos);
  EXPECT_NE(message({.cell_m = HUGE_VAL}).find("cell_m is inf m"), std::string::npos);
  EXPECT_NE(message({.error_m = 0.01, .cell_m = 0.1}).find("only one"), std::string::npos);
  EXPECT_NE(message({.sign = static_cast<FieldSign>(9)}).find("sign is 9"), std::string::npos);
}

/// Far from the origin cells do not become smaller than single precision separates.
TEST(FieldGrid, KeepsVerticesApart) {
  const Bounds box{{99'000.0f, 0.0f, 0.0f}, {99'001.0f, 1.0f, 1.0f}};
  const Grid grid = grid_around(box, 0.01);
  EXPECT_GT(grid.cell_m, 1.0f);
  const double fine = 1.0 / shared::field_brick_cells;
  EXPECT_LT(grid.point({0.0, 0.0, 0.0}).x, grid.point({fine, 0.0, 0.0}).x);
  const glm::dvec3 low(grid.origin_m);
  const glm::dvec3 high = low + static_cast<double>(grid.cell_m) * glm::dvec3(grid.cells);
  EXPECT_TRUE(glm::all(glm::lessThanEqual(low, glm::dvec3(box.minimum_m))));
  EXPECT_TRUE(glm::all(glm::greaterThanEqual(high, glm::dvec3(box.maximum_m))));
}

}  // namespace
}  // namespace rtstdb::field
