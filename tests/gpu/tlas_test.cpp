// Trees of entities from version to version: refitted while they serve, built anew when they do not, and
// right in either case.

#include "rtstdb/accel/tlas.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/gpu_test.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/version_rows.hpp"

namespace rtstdb::test {
namespace {

/// A small world is built by one workgroup, a large one by many passes.
class TreesFromVersionToVersion : public gpu::test::GpuTest,
                                  public testing::WithParamInterface<std::uint32_t> {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    submit_ = std::move(accel::Submit::create(device())).value();
    pool_ = std::move(accel::GeometryPool::create(device(), 1, submit_)).value();
    tlas_ = std::move(accel::Tlas::create(device(), {.max_entities = GetParam(), .slots = 1})).value();
    ASSERT_TRUE(
        pool_.add(device(), std::make_shared<const TriangleMesh>(make_box({1.0, 1.0, 1.0})), submit_).ok());
    ASSERT_TRUE(tlas_.bind(device(), pool_).ok());
  }
  void next(const std::function<std::optional<EntityRow>(std::uint32_t)>& make) {
    rows_.next(make, rows_.time() + Nanoseconds(1'000'000));
  }
  void prepare(Nanoseconds window = Nanoseconds(0)) {
    submit_.begin();
    ASSERT_TRUE(tlas_.prepare(rows_, {.times = {rows_.time(), rows_.time() + window}}, submit_).has_value());
    ASSERT_TRUE(submit_.run());
  }
  void expect_counts(std::uint64_t builds, std::uint64_t refits) const {
    EXPECT_EQ(tlas_.counts().builds, builds);
    EXPECT_EQ(tlas_.counts().refits, refits);
  }
  EntityRow anywhere() { return row_of({0}, 100.0 * random_.vector()); }

  Random random_{4};
  VersionRows rows_{GetParam()};
  accel::Submit submit_;
  accel::GeometryPool pool_;
  accel::Tlas tlas_;
};

TEST_P(TreesFromVersionToVersion, AreRefittedWhileNobodyComesOrGoesAndTheyServe) {
  std::vector<EntityRow> places;
  for (std::uint32_t i = 0; i < GetParam(); ++i)
    places.push_back(anywhere());
  const auto as_they_are = [&](std::uint32_t i) { return std::optional(places[i]); };
  next(as_they_are);
  prepare();
  expect_counts(1, 0);
  prepare();
  expect_counts(1, 0);  // the same version and window
  for (int k = 0; k < 5; ++k) {
    for (EntityRow& row : places)
      row.motion.p_world_m += 0.1 * random_.vector();
    next(as_they_are);
    prepare();
  }
  expect_counts(1, 5);

  next([&](std::uint32_t i) { return i == 7 ? std::nullopt : as_they_are(i); });
  prepare();
  expect_counts(2, 5);  // one went
  next(as_they_are);
  prepare();
  expect_counts(3, 5);  // and came back
  EntityRow hidden = places[7];
  hidden.geometry = {};
  next([&](std::uint32_t i) { return i == 7 ? std::optional(hidden) : as_they_are(i); });
  prepare();
  expect_counts(4, 5);  // has no geometry now

  next(as_they_are);
  prepare();
  next([&](std::uint32_t) { return std::optional(anywhere()); });
  prepare();
  next([&](std::uint32_t) { return std::optional(anywhere()); });
  prepare();
  // Everything is elsewhere: a large tree is made anew at once, a small one for the version after.
  const std::uint64_t at_once = GetParam() > shared::small_build_max ? 1 : 0;
  expect_counts(6 + at_once, 6 + at_once);
}

/// Sheets in a few heaps: a tree over their centres costs far less than one over them.
TEST_P(TreesFromVersionToVersion, CostTheSameWhetherTheWindowIsAnInstantOrNot) {
  std::vector<EntityRow> places;
  for (std::uint32_t i = 0; i < GetParam(); ++i) {
    const double angle_rad = 0.25 * std::numbers::pi * (i % 8);
    EntityRow& row =
        places.emplace_back(row_of({0}, 20.0 * glm::dvec3(std::cos(angle_rad), std::sin(angle_rad), 0.0)));
    row.scale = {5.0, 5.0, 0.01};
  }
  const auto as_they_are = [&](std::uint32_t i) { return std::optional(places[i]); };
  for (const Nanoseconds window : {Nanoseconds(0), Nanoseconds(1'000), Nanoseconds(0), Nanoseconds(1'000)}) {
    next(as_they_are);
    prepare(window);
  }
  next(as_they_are);
  prepare();
  expect_counts(1, 4);
}

INSTANTIATE_TEST_SUITE_P(Sizes, TreesFromVersionToVersion, testing::Values(100u, 1500u, 2500u));

/// Versions in which all move, some turn fast, some come and go, and once the whole world is elsewhere. At
/// last one is so far away that the upper words of the codes tell few others apart.
class MovingWorlds : public DatabaseTest, public testing::WithParamInterface<std::uint32_t> {};

TEST_P(MovingWorlds, AreSeenAsTheyAreInEveryVersion) {
  const std::uint32_t count = GetParam();
  open({.max_entities = 4096});
  Random random(count);
  SceneOptions options{.radius_m = 2.5 * std::cbrt(static_cast<double>(count))};
  std::vector<GeometryId> geometries;
  for (const TriangleMesh& mesh : mixed_meshes(random))
    geometries.push_back(add(mesh));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < count; ++i)
    rows.push_back(random_row(random, geometries, options, rows));
  std::vector<EntityId> ids = create(rows, at_s(1.0));
  const auto query = prepare_rays(RayMode::closest, false, 300);
  std::optional<oracle::World> world;
  std::size_t hits = 0;
  for (int k = 1; k <= 24; ++k) {
    options.version_time = at_s(1.0 + 0.01 * k);
    const bool elsewhere = k == 12;
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          for (std::uint32_t i = 0; i < count; ++i) {
            EntityRow row = random_row(random, geometries, options, rows);
            if (!elsewhere) {
              row.motion.p_world_m = rows[i].motion.p_world_m + 0.05 * random.vector();
              row.geometry = rows[i].geometry;
            }
            if (k >= 16 && i == 0) row.motion.p_world_m = glm::dvec3(9e4);
            row.motion.valid_from = options.version_time;
            rows[i] = row;
            transaction.update(ids[i], row);
          }
        },
        options.version_time);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    const auto entities = database().snapshot({}).value();
    std::vector<Ray> rays(300);
    for (Ray& ray : rays)
      ray = random_ray(random, entities, options, options.version_time, k % 3 == 0 ? 0.0 : 0.4);
    world = world ? world->with_entities(entities, options.version_time) : this->world();
    const auto answers = trace(*query, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto truth = oracle::trace(*world, rays[i]);
      const auto verdict = oracle::compare(*world, rays[i], RayMode::closest, false, truth, answers[i]);
      ASSERT_NE(verdict.verdict, oracle::Verdict::differs) << "version " << k << ": " << verdict.reason;
      hits += truth.status == HitStatus::hit ? 1 : 0;
    }
    if (k % 8 == 0) {
      ASSERT_TRUE(
          execute([&](Transaction& transaction) { transaction.remove(ids[count / 2]); }, options.version_time)
              .done());
      ids[count / 2] = create(rows[count / 2], options.version_time);
    }
  }
  EXPECT_GT(hits, 24u * 300u / 5u);
}

INSTANTIATE_TEST_SUITE_P(Sizes, MovingWorlds, testing::Values(12u, 300u, 2300u));

}  // namespace
}  // namespace rtstdb::test
