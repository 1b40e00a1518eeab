// Distance fields on the device: the distances from which they are built, fields of meshes against the
// oracle, and builds by a database beside its transactions.

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <thread>

#include "rtstdb/accel/field_sampler.hpp"
#include "rtstdb/field/field_build.hpp"
#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/oracle/mesh_distance.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/structure_walk.hpp"
#include "tests/support/field_meshes.hpp"
#include "tests/support/real_data.hpp"

namespace rtstdb::test {
namespace {

double diagonal_m(const TriangleMesh& mesh) {
  const Bounds box = bounds_of(mesh);
  return glm::distance(glm::dvec3(box.minimum_m), glm::dvec3(box.maximum_m));
}

glm::dvec3 random_point_near(Random& random, const TriangleMesh& mesh) {
  const Bounds box = bounds_of(mesh);
  const glm::dvec3 middle = 0.5 * (glm::dvec3(box.minimum_m) + glm::dvec3(box.maximum_m));
  const glm::dvec3 half = 0.5 * (glm::dvec3(box.maximum_m) - glm::dvec3(box.minimum_m));
  return middle + (1.2 * half + 0.1 * diagonal_m(mesh)) *
                      glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

class DeviceFields : public StructureTest {
 protected:
  void SetUp() override {
    StructureTest::SetUp();
    auto sampler = accel::FieldSampler::create(device());
    ASSERT_TRUE(sampler.ok()) << sampler.error().message;
    sampler_ = std::move(sampler).value();
  }

  std::vector<shared::FieldSample> sample(std::uint32_t geometry, const TriangleMesh& mesh, FieldSign sign,
                                          std::span<const shared::FieldPoint> points) {
    std::vector<shared::FieldSample> samples(points.size());
    const auto done = sampler_.sample(device(), pool_, geometry, sign, accel::front_sign_of(mesh), points,
                                      samples, submit_);
    EXPECT_TRUE(done.ok()) << done.error().message;
    return samples;
  }

  field::StoredField build(std::uint32_t geometry, const TriangleMesh& mesh, const FieldOptions& options) {
    auto begun = field::FieldBuild::begin(bounds_of(mesh), is_closed(mesh), options);
    EXPECT_TRUE(begun.ok()) << begun.error().message;
    field::FieldBuild build = std::move(begun).value();
    std::vector<shared::FieldPoint> points(accel::FieldSampler::max_points);
    while (const std::size_t count = build.next(points)) {
      const FieldSign sign = build.needs_sign() ? build.sign() : FieldSign::none;
      const auto taken = build.take(sample(geometry, mesh, sign, std::span(points).first(count)));
      EXPECT_TRUE(taken.ok()) << taken.error().message;
      if (HasFailure()) break;
    }
    return std::move(build).field();
  }

  accel::FieldSampler sampler_;
  Random random_{48};
};

TEST_F(DeviceFields, DistancesAndGradientsAreThoseOfTheOracle) {
  std::vector<TriangleMesh> meshes{make_torus(3.0, 0.8, 24), make_plate_with_hole(4.0, 1.5, 0.6),
                                   make_small_station(), make_rectangle(2.0, 3.0)};
  for (const TriangleMesh& mesh : meshes) {
    const oracle::MeshDistance distance(mesh);
    const bool closed = is_closed(mesh);
    std::vector<shared::FieldPoint> points;
    for (int i = 0; i < 2000; ++i)
      points.push_back({glm::vec3(random_point_near(random_, mesh)), i % 3 == 0 ? 0.5f : 1e18f});
    const auto samples = sample(add(mesh), mesh, closed ? FieldSign::winding : FieldSign::none, points);
    const double noise_m = 1e-6 * diagonal_m(mesh);
    std::size_t inside = 0, none = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::dvec3 point_m(points[i].point_m);
      const oracle::MeshPoint nearest = distance.nearest(point_m);
      const double found_m = static_cast<double>(samples[i].distance_m);
      if (nearest.distance_m > static_cast<double>(points[i].radius_m)) {
        ++none;
        EXPECT_GT(std::abs(found_m), 1e37);
        continue;
      }
      ASSERT_NEAR(std::abs(found_m), nearest.distance_m, noise_m) << i;
      ASSERT_NEAR(glm::length(glm::dvec3(samples[i].gradient)), 1.0, 1e-5) << i;
      if (nearest.distance_m < 100.0 * noise_m) continue;
      const bool is_inside = closed && distance.is_inside(point_m);
      inside += is_inside ? 1 : 0;
      EXPECT_EQ(found_m < 0.0, is_inside) << i;
      // The gradient leads to a nearest point, which need not be the oracle's if several are equally near.
      const glm::dvec3 foot_m = point_m - found_m * glm::dvec3(samples[i].gradient);
      EXPECT_LT(distance.nearest(foot_m).distance_m, 1e-5 * diagonal_m(mesh)) << i;
    }
    EXPECT_GT(none, 20u);
    if (closed) {
      EXPECT_GT(inside, 20u);
    }
  }
}

/// A point with nearly the same distance to very many triangles.
TEST_F(DeviceFields, EndASearchAmongEqualDistances) {
  const TriangleMesh mesh = make_sphere(1.0, 6);
  const shared::FieldPoint center{{0.0f, 0.0f, 0.0f}, 1e18f};
  const auto samples = sample(add(mesh), mesh, FieldSign::winding, std::span(&center, 1));
  EXPECT_NEAR(samples[0].distance_m, -1.0f, 2e-3f);
}

/// On a convex body every ray from inside hits a back, and every ray from outside a front or nothing.
TEST_F(DeviceFields, RayRatioFindsTheInside) {
  const TriangleMesh mesh = make_sphere(2.0, 3);
  const oracle::MeshDistance distance(mesh);
  std::vector<shared::FieldPoint> points;
  for (int i = 0; i < 1000; ++i)
    points.push_back({glm::vec3(random_point_near(random_, mesh)), 1e18f});
  const std::uint32_t sphere = add(mesh);
  const auto samples = sample(sphere, mesh, FieldSign::ray_ratio, points);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_inside = distance.is_inside(glm::dvec3(points[i].point_m));
    inside += is_inside ? 1 : 0;
    EXPECT_EQ(samples[i].distance_m < 0.0f, is_inside) << i;
  }
  EXPECT_GT(inside, 100u);

  // Half a sphere, without a winding number: in its middle half of the rays hit it from behind, and near its
  // bottom more than three quarters.
  TriangleMesh bowl = mesh;
  std::erase_if(bowl.triangles, [&](const glm::uvec3& t) {
    return mesh.positions_m[t.x].z + mesh.positions_m[t.y].z + mesh.positions_m[t.z].z > 0.0f;
  });
  const std::array<shared::FieldPoint, 2> two{{{{0.0f, 0.0f, 0.0f}, 1e18f}, {{0.0f, 0.0f, -1.9f}, 1e18f}}};
  const auto in_bowl = sample(add(bowl), bowl, FieldSign::ray_ratio, two);
  EXPECT_GT(in_bowl[0].distance_m, 0.0f);
  EXPECT_LT(in_bowl[1].distance_m, 0.0f);
}

/// A mesh with its fronts inside has the same signs and gradients.
TEST_F(DeviceFields, TurnedMeshesHaveTheSameField) {
  const TriangleMesh mesh = make_box({1.0, 2.0, 3.0});
  TriangleMesh turned = mesh;
  for (glm::uvec3& triangle : turned.triangles)
    std::swap(triangle.y, triangle.z);
  const auto field = build(add(mesh), mesh, {.cell_m = 0.1});
  const auto of_turned = build(add(turned), turned, {.cell_m = 0.1});
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 point_m = random_point_near(random_, mesh);
    EXPECT_NEAR(field.signed_distance_m(point_m), of_turned.signed_distance_m(point_m), 1e-4);
  }
}

struct Quantiles {
  double p50_m = 0.0, p99_m = 0.0, max_m = 0.0;
  std::size_t wrong_signs = 0, signs = 0;
};

/// At random points in the bricks of the field.
Quantiles compare(const field::StoredField& field, const oracle::MeshDistance& distance,
                  const TriangleMesh& mesh, Random& random, std::size_t count, bool signs) {
  std::vector<double> errors_m;
  Quantiles result;
  while (errors_m.size() < count) {
    const glm::dvec3 point_m = random_point_near(random, mesh);
    if (!field.is_in_brick(point_m)) continue;
    const double truth_m = distance.nearest(point_m).distance_m;
    errors_m.push_back(std::abs(field.distance_m(point_m) - truth_m));
    if (!signs || !field.is_signed || truth_m < field.report.cell_m) continue;
    ++result.signs;
    if ((field.signed_distance_m(point_m) < 0.0) != distance.is_inside(point_m)) ++result.wrong_signs;
  }
  std::ranges::sort(errors_m);
  result.p50_m = errors_m[count / 2];
  result.p99_m = errors_m[count * 99 / 100];
  result.max_m = errors_m.back();
  return result;
}

TEST_F(DeviceFields, HaveTheWantedErrorAndTheRightSigns) {
  const TriangleMesh meshes[] = {make_sphere(2.0, 4), make_torus(3.0, 0.8, 48),
                                 make_plate_with_hole(4.0, 1.5, 0.6), make_small_station(),
                                 make_rectangle(2.0, 3.0)};
  for (const TriangleMesh& mesh : meshes) {
    const oracle::MeshDistance distance(mesh);
    const field::StoredField field = build(add(mesh), mesh, {});
    if (HasFailure()) return;
    const double limit_m = diagonal_m(mesh) / 500.0;
    EXPECT_LE(field.report.error_p99_m, limit_m);
    const Quantiles found = compare(field, distance, mesh, random_, 2000, true);
    EXPECT_LE(found.p50_m, 0.3 * limit_m);
    EXPECT_LE(found.p99_m, 1.6 * limit_m);  // fewer and other points than those of the report
    EXPECT_LE(found.max_m, 0.6 * field.report.cell_m);
    EXPECT_EQ(found.wrong_signs, 0u);
    EXPECT_EQ(field.is_signed, is_closed(mesh));
    if (field.is_signed) {
      EXPECT_GT(found.signs, 300u);
    }
  }
}

class RealFields : public DeviceFields, public testing::WithParamInterface<std::filesystem::path> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RealFields);
INSTANTIATE_TEST_SUITE_P(Found, RealFields, testing::ValuesIn(hil::tests::real_mesh_folders()),
                         [](const auto&) { return "meshes"; });

TEST_P(RealFields, HaveTheWantedError) {
  std::size_t meshes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(GetParam())) {
    if (entry.path().extension() != ".obj") continue;
    const auto loaded = load_mesh(entry.path());
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    const TriangleMesh& mesh = loaded.value();
    const oracle::MeshDistance distance(mesh);
    const field::StoredField field = build(add(mesh), mesh, {});
    if (HasFailure()) return;
    const double diagonal = diagonal_m(mesh);
    const Quantiles found = compare(field, distance, mesh, random_, 2000, false);
    std::cout << entry.path().filename().string() << ": cell 1/" << diagonal / field.report.cell_m
              << " of the diagonal, " << field.report.bytes << " bytes, " << field.report.distances
              << " distances, error p50 1/" << diagonal / found.p50_m << ", p99 1/" << diagonal / found.p99_m
              << ", max 1/" << diagonal / found.max_m << '\n';
    EXPECT_LE(field.report.error_p99_m, diagonal / 500.0) << entry.path();
    EXPECT_LE(found.p99_m, 1.6 * diagonal / 500.0) << entry.path();
    EXPECT_LE(found.max_m, 0.6 * field.report.cell_m) << entry.path();
    ++meshes;
  }
  EXPECT_GT(meshes, 0u);
}

// ---- a database

class DatabaseFields : public DatabaseTest {};

TEST_F(DatabaseFields, AreRefusedWhenTheirProgressFunctionThrows) {
  FieldOptions options;
  options.progress = [](const FieldProgress&) { throw std::runtime_error("stop here"); };
  const auto refused = database().add_geometry(make_torus(3.0, 0.8, 24), "throws", {.field = options});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_NE(refused.error().message.find("threw: stop here"), std::string::npos) << refused.error().message;
  options.progress = [](const FieldProgress&) { throw 1; };
  const GeometryId without = add(make_torus(3.0, 0.8, 24));
  EXPECT_FALSE(database().build_field(without, options).ok());
  EXPECT_TRUE(database().build_field(without, {}).ok()) << "the build that was given up leaves nothing";
}

TEST_F(DatabaseFields, AreBuiltWithAGeometryOrLater) {
  const TriangleMesh mesh = make_torus(3.0, 0.8, 24);
  std::uint64_t before = 0, calls = 0;
  const auto named_by_a_row = [&] {
    return execute([&](Transaction& transaction) { transaction.create(row_of({0})); }).status;
  };
  FieldOptions options;
  options.progress = [&](const FieldProgress& progress) {
    // The device has it, rows do not yet.
    if (calls == 0) {
      EXPECT_EQ(named_by_a_row(), Status::bad_input);
    }
    EXPECT_GT(progress.distances, before);
    EXPECT_LE(progress.distances, progress.expected);
    before = progress.distances;
    ++calls;
  };
  const auto with = database().add_geometry(mesh, "with", {.field = options});
  ASSERT_TRUE(with.ok()) << with.error().message;
  const auto report = database().field(with.value());
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->distances, before);
  EXPECT_GT(calls, 3u);
  EXPECT_EQ(named_by_a_row(), Status::committed);
  EXPECT_LE(report->error_p99_m, diagonal_m(mesh) / 500.0);
  EXPECT_EQ(report->sign, FieldSign::winding);
  EXPECT_GT(report->seconds, 0.0);

  const auto later = database().add_geometry(mesh, "later");
  ASSERT_TRUE(later.ok());
  EXPECT_FALSE(database().field(later.value()).has_value());
  const auto built = database().build_field(later.value(), {});
  ASSERT_TRUE(built.ok()) << built.error().message;
  EXPECT_EQ(built.value().bytes, report->bytes);
  EXPECT_EQ(built.value().error_p99_m, report->error_p99_m);
  EXPECT_EQ(database().field(later.value())->bricks, report->bricks);
}

TEST_F(DatabaseFields, WaitForTheFirstQueryThatNeedsThem) {
  const auto added = database().add_geometry(make_torus(3.0, 0.8, 24), "torus",
                                             {.field = FieldOptions{.on_first_use = true}});
  ASSERT_TRUE(added.ok()) << added.error().message;
  ConeQueryOptions options{.name = "cones", .capacity = 1};
  ASSERT_TRUE(database().prepare(options).ok());
  EXPECT_FALSE(database().field(added.value()).has_value());
  options.mode = ConeMode::fast;
  const auto fast = database().prepare(options);
  ASSERT_TRUE(fast.ok()) << fast.error().message;
  EXPECT_TRUE(database().field(added.value()).has_value());
  create(row_of(added.value(), {0.0, 0.0, -20.0}));
  fast.value()->cones()[0] = {.direction = {0.15f, 0.0f, -1.0f}, .opening_angle_rad = 0.01f};
  ASSERT_TRUE(execute([&](Transaction& transaction) { transaction.add_query(*fast.value(), 1); }).done());
  EXPECT_EQ(fast.value()->returns()[0].status, HitStatus::hit);
  EXPECT_TRUE(fast.value()->returns()[0].by_field);
}

TEST_F(DatabaseFields, AreRefusedWithTheValuesAndTheirLimits) {
  const TriangleMesh mesh = make_box({1.0, 2.0, 3.0});
  const auto message = [](const auto& result) {
    return result.ok() ? std::string() : result.error().message;
  };
  const auto refused = [&](const GeometryOptions& options) {
    return message(database().add_geometry(mesh, "box", options));
  };
  FieldOptions options;
  options.max_bytes = max_field_bytes + 1;
  EXPECT_NE(refused({.field = options}).find("max_bytes is 17179869185; at most 17179869184"),
            std::string::npos);
  options = {};
  options.error_m = std::nan("");
  EXPECT_NE(refused({.field = options}).find("error_m is nan m"), std::string::npos);
  options = {.cell_m = 0.02, .max_bytes = 50'000};
  EXPECT_NE(refused({.field = options}).find("max_bytes is 50000"), std::string::npos);
  EXPECT_NE(refused({.deforms = true, .field = FieldOptions{}}).find("deforms"), std::string::npos);
  // A geometry whose field is refused is not added.
  const GeometryId first = add(mesh);
  EXPECT_EQ(first.index, 0u);
  EXPECT_EQ(database().find_geometry("box"), std::nullopt);

  EXPECT_NE(message(database().build_field({7}, {})).find("geometry 7 does not exist"), std::string::npos);
  EXPECT_NE(message(database().build_field(first, {.sign = static_cast<FieldSign>(7)})).find("sign is 7"),
            std::string::npos);
  EXPECT_TRUE(database().build_field(first, {.cell_m = 0.2}).ok());
  EXPECT_NE(message(database().build_field(first, {})).find("has a distance field already"),
            std::string::npos);
  const auto open = database().add_geometry(make_rectangle(1.0, 1.0), "open");
  ASSERT_TRUE(open.ok());
  EXPECT_NE(
      message(database().build_field(open.value(), {.sign = FieldSign::winding})).find("closed geometry"),
      std::string::npos);
}

/// Transactions run between the parts of a build.
TEST_F(DatabaseFields, LetTransactionsInWhileTheyAreBuilt) {
  const EntityId entity = create(row_of(add(make_box({1.0, 1.0, 1.0}))));
  const TriangleMesh mesh = make_torus(3.0, 0.8, 96);
  std::atomic<bool> is_built{false};
  std::thread builder([&] {
    FieldOptions options;
    options.error_m = diagonal_m(mesh) / 3000.0;
    const auto added = database().add_geometry(mesh, "torus", {.field = options});
    EXPECT_TRUE(added.ok()) << added.error().message;
    is_built = true;
  });
  auto query = prepare_rays();
  query->rays()[0] = ray_from({0.0, 0.0, 5.0}, {0.0, 0.0, -1.0});
  std::size_t answered = 0;
  while (!is_built && !HasFailure()) {
    EXPECT_TRUE(run(*query, 1).done());
    EXPECT_EQ(query->hits()[0].entity, entity);
    ++answered;
  }
  builder.join();
  EXPECT_GT(answered, 20u);
}

}  // namespace
}  // namespace rtstdb::test
