#pragma once
// Fixture of tests that prepare a TLAS in a loop: a version and a batch with each tick.

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "rtstdb/accel/tlas.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/gpu_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/version_rows.hpp"

namespace rtstdb::test {

/// The parameter is the number of entities. One workgroup builds a small tree, several passes a large one.
class TlasTest : public gpu::test::GpuTest, public testing::WithParamInterface<std::uint32_t> {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    submit_ = std::move(accel::Submit::create(device())).value();
    pool_ = std::move(accel::GeometryPool::create(device(), 1, submit_)).value();
    ASSERT_TRUE(
        pool_.add(device(), std::make_shared<const TriangleMesh>(make_box({1.0, 1.0, 1.0})), submit_).ok());
    tlas_ = make_tlas(slots());
    rows_.next([&](std::uint32_t) { return std::optional(anywhere()); }, time_);
    prepare(1);
    ASSERT_EQ(tlas_.counts().builds, 1u);
  }
  virtual std::uint32_t slots() const { return 2; }
  accel::Tlas make_tlas(std::uint32_t slots) {
    auto made = accel::Tlas::create(device(), {.max_entities = GetParam(), .slots = slots});
    EXPECT_TRUE(made.ok() && made.value().bind(device(), pool_).ok());
    return std::move(made).value();
  }
  EntityRow anywhere() { return row_of({0}, 100.0 * random_.vector()); }
  static std::vector<std::uint32_t> first_indices(std::uint32_t count) {
    std::vector<std::uint32_t> indices(count);
    for (std::uint32_t i = 0; i < count; ++i)
      indices[i] = i;
    return indices;
  }
  /// The next version: the first `changed` entities move by a centimetre, or anywhere.
  void tick(std::uint32_t changed = 0, bool by_centimetres = false,
            Nanoseconds period = Nanoseconds(1'000'000)) {
    time_ += period;
    const auto moved = [&](std::uint32_t i) {
      EntityRow row = by_centimetres ? rows_.row(i)->row : anywhere();
      row.motion.p_world_m += glm::dvec3(0.01, 0.0, 0.0);
      return std::optional(row);
    };
    rows_.change(first_indices(changed), moved, time_);
  }
  std::optional<accel::TlasView> prepare(std::uint64_t elements, std::uint64_t shapes = 0) {
    return prepare(tlas_, {.times = {time_, time_}, .elements = elements, .shapes = shapes});
  }
  std::optional<accel::TlasView> prepare(accel::Tlas& tlas, const accel::TlasRequest& request) {
    submit_.begin();
    const auto view = tlas.prepare(rows_, request, submit_);
    EXPECT_TRUE(view.has_value() && submit_.run());
    return view;
  }
  accel::Tlas::Counts since(const accel::Tlas::Counts& before) const {
    const accel::Tlas::Counts now = tlas_.counts();
    return {now.builds - before.builds,          now.refits - before.refits,
            now.patches - before.patches,        now.rows - before.rows,
            now.renewals - before.renewals,      now.ahead - before.ahead,
            now.ahead_built - before.ahead_built};
  }

  Random random_{4};
  WorldTime time_ = at_s(1.0);
  VersionRows rows_{GetParam()};
  accel::Submit submit_;
  accel::GeometryPool pool_;
  accel::Tlas tlas_;
};

}  // namespace rtstdb::test
