// A store that continues from a recovered world.

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "live_world.hpp"
#include "rtstdb/log/world.hpp"
#include "rtstdb/store/motion_words.hpp"
#include "rtstdb/store/store.hpp"

namespace rtstdb::log::test {
namespace {

store::StoreOptions options() {
  return {.max_entities = live_entities,
          .retained_changes = 64,
          .geometry_known = [](GeometryId id) { return !id.valid() || id.index < 8; },
          .max_geometries = 8};
}

/// The ids of the entities, each with the version that wrote it.
std::vector<std::pair<EntityId, Version>> states(const store::Store& store) {
  std::vector<std::pair<EntityId, Version>> all;
  const store::Snapshot snapshot = store.latest_snapshot();
  for (std::uint32_t index = 0; index < snapshot.index_limit(); ++index) {
    const EntityState* state = snapshot.row(index);
    if (state != nullptr) all.emplace_back(state->id, state->written_by);
  }
  return all;
}

std::optional<BadInput> commit(store::Store& store, store::WriteSet& set) {
  if (auto fault = store.stage(set)) return fault;
  store.publish();
  store.complete_commit();
  return std::nullopt;
}

TEST(LogRecovery, RestoredStoreAssignsTheSameIdsAndVersions) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    std::mt19937_64 random(seed);
    store::Store original(options());
    World world;
    const auto random_set = [&](const store::Store& store) {
      store::WriteSet set{0, store.latest().version == 0 ? world_time_ns(0) : store.latest().time, {}};
      for (std::uint32_t index = 0; index < store.latest_snapshot().index_limit(); ++index) {
        const EntityState* state = store.latest_snapshot().row(index);
        if (state != nullptr && random() % 4 == 0)
          set.writes.push_back({store::WriteKind::remove, {state->id, {}, 0}});
      }
      for (std::uint64_t k = random() % 3; k > 0 || set.writes.empty(); k -= k > 0 ? 1 : 0)
        set.writes.push_back({store::WriteKind::create, {{}, {}, 0}});
      return set;
    };
    for (int k = 0; k < 40; ++k) {
      store::WriteSet set = random_set(original);
      if (random() % 5 == 0) {
        if (!original.stage(set)) original.discard();
        continue;
      }
      if (commit(original, set)) continue;
      ASSERT_EQ(world.apply(set), nullptr);
    }
    store::WriteSet probe{0, original.latest().time, {{store::WriteKind::create, {{}, {}, 0}}}};
    world.next_version = [&] {
      if (original.stage(probe)) return world.next_version;
      const Version next = probe.version;
      original.discard();
      return next + 1;
    }();

    store::Store restored(options());
    restored.restore(world.restored());
    ASSERT_EQ(restored.latest().version, original.latest().version);
    ASSERT_EQ(states(restored), states(original));
    for (int k = 0; k < 40; ++k) {
      store::WriteSet set = random_set(original);
      store::WriteSet same = set;
      const auto fault = commit(original, set);
      ASSERT_EQ(commit(restored, same).has_value(), fault.has_value());
      if (fault) continue;
      ASSERT_EQ(same.version, set.version) << "seed " << seed;
      for (std::size_t write = 0; write < set.writes.size(); ++write)
        ASSERT_EQ(same.writes[write].state.id, set.writes[write].state.id) << "seed " << seed;
      ASSERT_EQ(states(restored), states(original));
    }
  }
}

// Omitted words are taken from the row before.
TEST(LogRecovery, CompletesMotionsFromTheRowBefore) {
  World world;
  EntityRow row;
  row.motion.v_world_mps = {1.0, -0.0, 3.0};
  store::WriteSet set{1, world_time_ns(10), {{store::WriteKind::create, {{0, 1}, row, 1}}}};
  ASSERT_EQ(world.apply(set), nullptr);
  store::Write moves{store::WriteKind::update_motion, {{0, 1}, {}, 70'000}};
  moves.state.row.motion = store::motion_of({});
  moves.state.row.motion.p_world_m.y = 5.0;
  moves.unchanged = store::all_motion_words & ~0b10u;
  moves.base_version_low = 1;
  set = {70'000, world_time_ns(20), {moves}};
  ASSERT_EQ(world.apply(set), nullptr);
  row.motion.p_world_m.y = 5.0;
  EXPECT_EQ(store::words_of(set.writes[0].state.row.motion), store::words_of(row.motion)) << "in the set too";
  EXPECT_EQ(store::words_of(world.rows[0].row.motion), store::words_of(row.motion));

  const auto fault_of = [&](store::Write write) {
    store::WriteSet next{70'001, world_time_ns(30), {write}};
    const char* fault = world.apply(next);
    EXPECT_EQ(world.latest.version, 70'000u);
    return std::string(fault != nullptr ? fault : "");
  };
  EXPECT_NE(fault_of(moves).find("another version"), std::string::npos) << "the base is version 1";
  moves.base_version_low = 70'000 & 0xffff;
  moves.unchanged = store::all_motion_words & ~0b1000u;  // leaves an invalid orientation
  EXPECT_NE(fault_of(moves).find("invalid values"), std::string::npos);
  EXPECT_EQ(store::words_of(world.rows[0].row.motion), store::words_of(row.motion)) << "nothing has changed";
}

// Even if later writes of the same commit change the row again.
TEST(LogRecovery, CompletesEachWriteWithItsRow) {
  World world;
  EntityRow row;
  row.mask = 5;
  store::WriteSet set{1, world_time_ns(10), {{store::WriteKind::create, {{0, 1}, row, 1}}}};
  ASSERT_EQ(world.apply(set), nullptr);
  row.mask = 6;
  store::Write moves{store::WriteKind::update_motion, {{0, 1}, {}, 2}};
  moves.state.row.motion.p_world_m.y = 5.0;
  set = {2, world_time_ns(20), {{store::WriteKind::update, {{0, 1}, row, 2}}, moves, moves}};
  set.writes[2].kind = store::WriteKind::remove;
  ASSERT_EQ(world.apply(set), nullptr);
  EXPECT_EQ(set.writes[0].state.row.mask, 6u);
  EXPECT_EQ(set.writes[0].state.row.motion.p_world_m.y, 0.0);
  EXPECT_EQ(set.writes[1].state.row.mask, 6u);
  EXPECT_EQ(set.writes[1].state.row.motion.p_world_m.y, 5.0);
}

TEST(LogRecovery, VersionsBeforeTheRestoredOneAreTooOld) {
  World world;
  store::WriteSet set{9, world_time_ns(1000), {{store::WriteKind::create, {{0, 1}, {}, 9}}}};
  ASSERT_EQ(world.apply(set), nullptr);
  store::Store restored(options());
  restored.restore(world.restored());
  const auto reason = [&](const ReadAt& at) {
    const auto answer = restored.read(at);
    const auto* fault = std::get_if<BadInput>(&answer);
    return fault != nullptr ? fault->reason : BadInputReason::none;
  };
  EXPECT_EQ(reason(ReadAt::pinned(9)), BadInputReason::none);
  EXPECT_EQ(reason(ReadAt::pinned(8)), BadInputReason::snapshot_too_old);
  EXPECT_EQ(reason(ReadAt::pinned(0)), BadInputReason::snapshot_too_old);
  EXPECT_EQ(reason(ReadAt::pinned(10)), BadInputReason::unknown_version);
  EXPECT_EQ(reason(ReadAt::as_of(world_time_ns(1000))), BadInputReason::none);
  EXPECT_EQ(reason(ReadAt::as_of(world_time_ns(999))), BadInputReason::snapshot_too_old);
  store::WriteSet next{0, world_time_ns(1000), {{store::WriteKind::remove, {{0, 1}, {}, 0}}}};
  ASSERT_FALSE(commit(restored, next));
  EXPECT_EQ(next.version, 10u);
  EXPECT_EQ(reason(ReadAt::pinned(9)), BadInputReason::none);
}

}  // namespace
}  // namespace rtstdb::log::test
