// Small batches, ticks that follow one another: where few rows change slots are patched, where more do they
// are renewed, and nobody can tell.

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <ostream>

#include "shaders/shared/build.h"
#include "tests/gpu/ticking_trees.hpp"

namespace rtstdb::test {
namespace {

using PatchedTrees = TickingTrees;

TEST_P(PatchedTrees, NeitherRefitNorBuildForFewChangesOfATick) {
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

TEST_P(PatchedTrees, AreMadeAnewWhenTheWindowHasPassed) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 600; ++k) {
    tick();
    prepare(1);
  }
  const auto counts = since(before);
  if (GetParam() < accel::min_made_ahead) {
    EXPECT_EQ(counts.builds, 1u);  // of the slot that was empty
    EXPECT_EQ(counts.refits, 1u);
    EXPECT_EQ(counts.patches, 598u);
  } else {
    EXPECT_EQ(counts.builds + counts.refits, 0u);
    EXPECT_GE(counts.ahead, 2u);
    EXPECT_EQ(counts.patches, 600u);
  }
}

TEST_P(PatchedTrees, AreMadeAnewWhenManyHaveBeenPatched) {
  const auto before = tlas_.counts();
  const std::uint32_t most = GetParam() / accel::patched_share;
  const std::uint32_t part = std::min(most, shared::max_patched);
  std::uint64_t patches = 0;
  for (std::uint32_t patched = 0; patched + part <= most; patched += part, ++patches) {
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

TEST_P(PatchedTrees, AreRenewedWhereMoreChangeThanAPatchIsGoodFor) {
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
  // What is left of a patch's share is there again.
  tick(8, true);
  prepare(1);
  EXPECT_EQ(since(before).patches, 1u);
}

TEST_P(PatchedTrees, AreNotRenewedWhereMoreThanTheShareChanges) {
  const auto before = tlas_.counts();
  tick(GetParam() / accel::renewed_share + 1, true);
  prepare(1);
  EXPECT_EQ(since(before).renewals + since(before).patches, 0u);
  EXPECT_EQ(since(before).refits + since(before).builds, 1u);
}

TEST_P(PatchedTrees, AreBuiltWhenRenewalsHaveMadeThemBad) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 60 && since(before).builds == 0; ++k) {
    tick(GetParam() / accel::renewed_share);
    prepare(1);
  }
  EXPECT_GT(since(before).renewals, 0u);
  EXPECT_GT(since(before).builds, 0u);
}

TEST_P(PatchedTrees, AreBuiltWhenSomebodyGoesOrIsSeenNoMore) {
  const auto before = tlas_.counts();
  time_ += Nanoseconds(1'000'000);
  const std::uint32_t one = 3;
  rows_.change(
      {&one, 1}, [](std::uint32_t) { return std::nullopt; }, time_);
  prepare(1);
  EXPECT_EQ(since(before).builds, 1u);
  EntityRow hidden = anywhere();
  hidden.geometry = {};
  time_ += Nanoseconds(1'000'000);
  const std::uint32_t other = 5;
  rows_.change(
      {&other, 1}, [&](std::uint32_t) { return std::optional(hidden); }, time_);
  prepare(1);
  EXPECT_EQ(since(before).builds, 2u);
  EXPECT_EQ(since(before).refits + since(before).patches, 0u);
}

TEST_P(PatchedTrees, HaveWindowsNoLongerThanALargeBatchAsks) {
  const auto before = tlas_.counts();
  time_ += accel::window_ahead;  // behind the window
  for (int k = 0; k < 6; ++k) {
    tick();
    prepare(GetParam());
  }
  EXPECT_EQ(since(before).patches, 0u);
  EXPECT_EQ(since(before).builds, 1u);  // of the slot that was empty
  EXPECT_EQ(since(before).refits, 5u);
}

INSTANTIATE_TEST_SUITE_P(Sizes, PatchedTrees, testing::Values(100u, 1500u, 9000u));

struct Ticks {
  std::uint32_t entities, max_changed;
};

void PrintTo(const Ticks& ticks, std::ostream* out) {
  *out << ticks.entities << " entities, of which up to " << ticks.max_changed << " change";
}

/// Ticks in which bodies get other motions, looks or masks, and some rays are asked.
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
          transaction.update(ids_[0], rows_[0]);  // a transaction without writes makes no version
        },
        options_.version_time);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
  }
  std::vector<Ray> rays(std::size_t count) {
    const auto entities = database().snapshot({}).value();
    std::vector<Ray> made(count);
    for (Ray& ray : made)
      ray = random_ray(random_, entities, options_, options_.version_time, 0.02);
    return made;
  }

  Random random_{7};
  SceneOptions options_{.radius_m = 0.0, .version_time = at_s(1.0)};
  std::vector<TriangleMesh> meshes_;
  std::vector<GeometryId> geometries_;
  std::vector<EntityRow> rows_;
  std::vector<EntityId> ids_;
};

TEST_P(PatchedWorlds, AreSeenAsTheyAre) {
  fill(GetParam().entities);
  const auto query = prepare_rays(RayMode::closest, false, 32);
  Tally tally;
  std::optional<oracle::World> world;
  for (int k = 0; k < 60; ++k) {
    tick();
    const auto asked = rays(32);
    const auto entities = database().snapshot({}).value();
    world = world ? world->with_entities(entities, options_.version_time) : this->world();
    tally += judge(*world, asked, trace(*query, asked));
    if (HasFatalFailure() || HasNonfatalFailure()) break;
  }
  EXPECT_GT(tally.hits, tally.elements / 5);
}

/// Some read what was a moment ago, now and then somebody comes or goes, and some batches are large.
TEST_P(PatchedWorlds, AreSeenAsTheyWereAndAre) {
  fill(GetParam().entities);
  const auto query = prepare_rays(RayMode::closest, false, 64);
  const auto many = prepare_rays(RayMode::closest, false, 2048);
  struct Then {
    WorldTime time;
    oracle::World world;
    std::vector<Ray> rays;
  };
  std::vector<Then> past;
  Tally tally;
  for (int k = 0; k < 120 && !HasFailure(); ++k) {
    tick();
    if (random_.one_in(40)) {
      remove(ids_[1], options_.version_time);
      ids_[1] = create(rows_[1], options_.version_time);
    }
    if (random_.one_in(25)) trace(*many, rays(2048));
    const auto asked = rays(32);
    trace(*query, asked);
    if (k % 8 == 0) past.push_back({options_.version_time, world(), asked});
    if (past.empty() || !random_.one_in(3)) continue;
    const Then& then = past[past.size() - 1 - random_.below(std::min<std::size_t>(past.size(), 3))];
    tally += judge(then.world, then.rays, trace(*query, then.rays, ReadAt::as_of(then.time)));
  }
  EXPECT_GT(tally.hits, tally.elements / 5);
}

std::uint32_t bits_of(float value) {
  return std::bit_cast<std::uint32_t>(value);
}

/// A slot that was patched a hundred times answers with the bits of one that was made for its version.
TEST_P(PatchedWorlds, AnswerBitForBitAsThoseMadeAnew) {
  fill(GetParam().entities);
  const auto query = prepare_rays(RayMode::closest, false, 64);
  for (int k = 0; k < 100; ++k) {
    tick();
    trace(*query, rays(8));
  }
  const auto asked = rays(64);
  const auto patched = trace(*query, asked);

  open({});
  geometries_.clear();
  for (const TriangleMesh& mesh : meshes_)
    geometries_.push_back(add(mesh));
  create(rows_, options_.version_time);
  const auto fresh_query = prepare_rays(RayMode::closest, false, 64);
  const auto fresh = trace(*fresh_query, asked);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    EXPECT_EQ(bits_of(patched[i].lambda), bits_of(fresh[i].lambda)) << "ray " << i;
    EXPECT_EQ(bits_of(patched[i].u), bits_of(fresh[i].u));
    EXPECT_EQ(bits_of(patched[i].v), bits_of(fresh[i].v));
    EXPECT_EQ(patched[i].entity, fresh[i].entity);
    EXPECT_EQ(patched[i].triangle, fresh[i].triangle);
    EXPECT_EQ(patched[i].n_world, fresh[i].n_world);
    EXPECT_EQ(patched[i].v_relative_mps, fresh[i].v_relative_mps);
    hits += patched[i].status == HitStatus::hit ? 1 : 0;
  }
  EXPECT_GT(hits, asked.size() / 5);
}

// Patches; and with them renewals, between which trees are built.
INSTANTIATE_TEST_SUITE_P(Sizes, PatchedWorlds,
                         testing::Values(Ticks{400, 5}, Ticks{3001, 5}, Ticks{400, 95}, Ticks{3000, 700}));

}  // namespace
}  // namespace rtstdb::test
