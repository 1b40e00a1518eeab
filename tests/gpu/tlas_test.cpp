// A TLAS from version to version: refitted while its tree is cheap, built when it is not.

#include "rtstdb/accel/tlas.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/gpu_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/version_rows.hpp"

namespace rtstdb::test {
namespace {

/// One workgroup builds a small tree, several passes a large one.
class TlasFromVersionToVersion : public gpu::test::GpuTest,
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

TEST_P(TlasFromVersionToVersion, IsRefittedWhileTheSameEntitiesExistAndTheTreeIsCheap) {
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
  expect_counts(2, 5);  // one is removed
  next(as_they_are);
  prepare();
  expect_counts(3, 5);  // and created
  EntityRow hidden = places[7];
  hidden.geometry = {};
  next([&](std::uint32_t i) { return i == 7 ? std::optional(hidden) : as_they_are(i); });
  prepare();
  expect_counts(4, 5);  // one loses its geometry

  next(as_they_are);
  prepare();
  next([&](std::uint32_t) { return std::optional(anywhere()); });
  prepare();
  next([&](std::uint32_t) { return std::optional(anywhere()); });
  prepare();
  // All entities are elsewhere: a large tree is built at once, a small one for the next version.
  const std::uint64_t at_once = GetParam() > shared::small_build_max ? 1 : 0;
  expect_counts(6 + at_once, 6 + at_once);
}

/// Coincident sheets: the estimated cost must not depend on whether the window is an instant.
TEST_P(TlasFromVersionToVersion, HasTheSameCostForAnInstantAndAWindow) {
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

INSTANTIATE_TEST_SUITE_P(Sizes, TlasFromVersionToVersion, testing::Values(100u, 1500u, 2500u));

}  // namespace
}  // namespace rtstdb::test
