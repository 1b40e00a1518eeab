// Slots of a TLAS in loops of small batches: patched if few rows change, renewed if more change, with the
// answers of newly made slots.

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <ostream>

#include "shaders/shared/build.h"
#include "tests/gpu/tlas_fixture.hpp"

namespace rtstdb::test {
namespace {

using PatchedSlots = TlasTest;

TEST_P(PatchedSlots, AreNeitherRefittedNorBuiltForFewChanges) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 20; ++k) {
    tick(k % 2);
    prepare(1);
  }
  const auto counts = since(before);
  EXPECT_EQ(counts.builds, 0u);
  EXPECT_EQ(counts.refits, 0u);
  EXPECT_EQ(counts.patches, 20u);
}

TEST_P(PatchedSlots, AreReplacedWhenTheWindowEnds) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 600; ++k) {
    tick();
    prepare(1);
  }
  const auto counts = since(before);
  if (GetParam() < accel::min_made_ahead) {
    EXPECT_EQ(counts.builds, 1u);  // of the empty slot
    EXPECT_EQ(counts.refits, 1u);
    EXPECT_EQ(counts.patches, 598u);
  } else {
    EXPECT_EQ(counts.builds + counts.refits, 0u);
    EXPECT_GE(counts.ahead, 2u);
    EXPECT_EQ(counts.patches, 600u);
  }
}

TEST_P(PatchedSlots, AreRefittedOrBuiltAfterManyPatches) {
  const auto before = tlas_.counts();
  const std::uint32_t max_patched = GetParam() / accel::patched_share;
  const std::uint32_t part = std::min(max_patched, shared::max_patched);
  std::uint64_t patches = 0;
  for (std::uint32_t patched = 0; patched + part <= max_patched; patched += part, ++patches) {
    tick(part);
    prepare(1);
  }
  EXPECT_EQ(since(before).patches, patches);
  EXPECT_EQ(since(before).refits + since(before).builds, 0u);
  tick(part);
  prepare(1);
  EXPECT_EQ(since(before).patches, patches);
  EXPECT_EQ(since(before).refits + since(before).builds, 1u);
}

TEST_P(PatchedSlots, AreRenewedForMoreChangesThanAPatchHas) {
  const auto before = tlas_.counts();
  const std::uint32_t changed = GetParam() / accel::renewed_share;
  for (int k = 0; k < 10; ++k) {
    tick(changed, true);
    prepare(1);
  }
  const auto counts = since(before);
  EXPECT_EQ(counts.renewals, 10u);
  EXPECT_EQ(counts.refits, 10u);
  EXPECT_EQ(counts.builds + counts.patches, 0u);
  EXPECT_EQ(counts.rows, 10u * changed);
  // After a renewal patches are allowed again.
  tick(8, true);
  prepare(1);
  EXPECT_EQ(since(before).patches, 1u);
}

TEST_P(PatchedSlots, AreNotRenewedForMoreChangesThanTheRenewedShare) {
  const auto before = tlas_.counts();
  tick(GetParam() / accel::renewed_share + 1, true);
  prepare(1);
  EXPECT_EQ(since(before).renewals + since(before).patches, 0u);
  EXPECT_EQ(since(before).refits + since(before).builds, 1u);
}

TEST_P(PatchedSlots, AreBuiltWhenRenewalsMakeTheTreeExpensive) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 60 && since(before).builds == 0; ++k) {
    tick(GetParam() / accel::renewed_share);
    prepare(1);
  }
  EXPECT_GT(since(before).renewals, 0u);
  EXPECT_GT(since(before).builds, 0u);
}

TEST_P(PatchedSlots, AreBuiltWhenAnEntityIsRemovedOrLosesItsGeometry) {
  const auto before = tlas_.counts();
  time_ += Nanoseconds(1'000'000);
  const std::uint32_t removed = 3;
  rows_.change(
      {&removed, 1}, [](std::uint32_t) { return std::nullopt; }, time_);
  prepare(1);
  EXPECT_EQ(since(before).builds, 1u);
  EntityRow hidden = anywhere();
  hidden.geometry = {};
  time_ += Nanoseconds(1'000'000);
  const std::uint32_t without_geometry = 5;
  rows_.change(
      {&without_geometry, 1}, [&](std::uint32_t) { return std::optional(hidden); }, time_);
  prepare(1);
  EXPECT_EQ(since(before).builds, 2u);
  EXPECT_EQ(since(before).refits + since(before).patches, 0u);
}

TEST_P(PatchedSlots, HaveTheWindowOfALargeBatch) {
  const auto before = tlas_.counts();
  time_ += accel::window_ahead;  // after the window
  for (int k = 0; k < 6; ++k) {
    tick();
    prepare(GetParam());
  }
  EXPECT_EQ(since(before).patches, 0u);
  EXPECT_EQ(since(before).builds, 1u);  // of the empty slot
  EXPECT_EQ(since(before).refits, 5u);
}

INSTANTIATE_TEST_SUITE_P(Sizes, PatchedSlots, testing::Values(100u, 1500u, 9000u));

struct Ticks {
  std::uint32_t entities, max_changed;
};

void PrintTo(const Ticks& ticks, std::ostream* out) {  // NOLINT(readability-identifier-naming)
  *out << ticks.entities << " entities, of which up to " << ticks.max_changed << " change";
}

/// With each tick some bodies get other motions, geometries or masks, and a small batch of rays runs.
class PatchedWorlds : public DatabaseTest, public testing::WithParamInterface<Ticks> {
 protected:
  void fill(std::uint32_t count) {
    options_.radius_m = 2.5 * std::cbrt(static_cast<double>(count));
    for (const TriangleMesh& mesh : mixed_meshes(random_)) {
      meshes_.push_back(mesh);
      geometries_.push_back(add(mesh));
    }
    for (std::uint32_t i = 0; i < count; ++i)
      rows_.push_back(random_row(random_, geometries_, options_, rows_));
    ids_ = create(rows_, options_.version_time);
  }
  void tick() {
    options_.version_time += Nanoseconds(1'000'000 + static_cast<std::int64_t>(random_.below(20'000'000)));
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          for (std::size_t k = random_.below(GetParam().max_changed + 1); k > 0; --k) {
            const std::size_t i = random_.below(rows_.size());
            EntityRow row = random_row(random_, geometries_, options_, rows_);
            row.motion.valid_from = options_.version_time;
            if (row.geometry.valid() != rows_[i].geometry.valid()) row.geometry = rows_[i].geometry;
            rows_[i] = row;
            transaction.update(ids_[i], row);
          }
          transaction.update(ids_[0], rows_[0]);  // a transaction without writes commits no version
        },
        options_.version_time);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
  }
  std::vector<Ray> rays(std::size_t count) {
    const auto entities = database().snapshot({}).value();
    std::vector<Ray> rays(count);
    for (Ray& ray : rays)
      ray = random_ray(random_, entities, options_, options_.version_time, 0.02);
    return rays;
  }

  Random random_{7};
  SceneOptions options_{.radius_m = 0.0, .version_time = at_s(1.0)};
  std::vector<TriangleMesh> meshes_;
  std::vector<GeometryId> geometries_;
  std::vector<EntityRow> rows_;
  std::vector<EntityId> ids_;
};

/// Some batches read an earlier version, some are large, and in some ticks an entity is removed and created.
TEST_P(PatchedWorlds, AnswerAsTheOracleInRecentVersions) {
  fill(GetParam().entities);
  const auto query = prepare_rays(RayMode::closest, false, 64);
  const auto many = prepare_rays(RayMode::closest, false, 2048);
  struct PastVersion {
    WorldTime time;
    oracle::World world;
    std::vector<Ray> rays;
  };
  std::vector<PastVersion> past;
  Tally tally;
  for (int k = 0; k < 120 && !HasFailure(); ++k) {
    tick();
    if (random_.one_in(40)) {
      remove(ids_[1], options_.version_time);
      ids_[1] = create(rows_[1], options_.version_time);
    }
    if (random_.one_in(25)) trace(*many, rays(2048));
    const auto sampled = rays(32);
    trace(*query, sampled);
    if (k % 8 == 0) past.push_back({options_.version_time, world(), sampled});
    if (past.empty() || !random_.one_in(3)) continue;
    const PastVersion& version = past[past.size() - 1 - random_.below(std::min<std::size_t>(past.size(), 3))];
    tally += judge(version.world, version.rays, trace(*query, version.rays, ReadAt::as_of(version.time)));
  }
  EXPECT_GT(tally.hits, tally.elements / 5);
}

/// After a hundred patches.
TEST_P(PatchedWorlds, AnswerWithTheBitsOfANewlyMadeSlot) {
  fill(GetParam().entities);
  auto query = prepare_rays(RayMode::closest, false, 64);
  for (int k = 0; k < 100; ++k) {
    tick();
    trace(*query, rays(8));
  }
  const auto sampled = rays(64);
  const auto patched = trace(*query, sampled);

  query.reset();
  open({});
  geometries_.clear();
  for (const TriangleMesh& mesh : meshes_)
    geometries_.push_back(add(mesh));
  create(rows_, options_.version_time);
  const auto fresh_query = prepare_rays(RayMode::closest, false, 64);
  const auto fresh = trace(*fresh_query, sampled);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < sampled.size(); ++i) {
    EXPECT_TRUE(same_bits(patched[i], fresh[i])) << "ray " << i;
    hits += patched[i].status == HitStatus::hit ? 1 : 0;
  }
  EXPECT_GT(hits, sampled.size() / 5);
}

// Up to 5 changes are patches; the larger numbers cause renewals and builds too.
INSTANTIATE_TEST_SUITE_P(Sizes, PatchedWorlds,
                         testing::Values(Ticks{400, 5}, Ticks{3001, 5}, Ticks{400, 95}, Ticks{3000, 700}));

}  // namespace
}  // namespace rtstdb::test
