// Recovery of each version, of salvaged logs, and of a store from a recovered world.

#include "rtstdb/log/recovery.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "rtstdb/log/writer.hpp"
#include "rtstdb/store/motion_words.hpp"
#include "sample_log.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

using hil::tests::SimulatedDisk;

TEST(LogRecovery, OfAnEmptyDirectoryIsAnEmptyWorld) {
  SimulatedDisk disk(1);
  const Recovered recovered = recover(disk).value();
  EXPECT_EQ(recovered.world.latest.version, 0u);
  EXPECT_EQ(recovered.report.describe(), "there is no log yet");
}

TEST(LogRecovery, RecoversEveryVersion) {
  const SampleLog sample = make_sample({.seed = 11, .commits = 60});
  SimulatedDisk disk(1, sample.contents);
  Image expected = sample.history.images.at(0);
  for (Version version = 0; version <= sample.latest + 1; ++version) {
    if (sample.history.valid.count(version) != 0) expected = sample.history.images.at(version);
    const auto recovered = recover(disk, {.up_to_version = version});
    ASSERT_TRUE(recovered.ok()) << recovered.error().message;
    ASSERT_TRUE(image_of(recovered.value().world) == expected)
        << "version " << version << ": " << recovered.value().report.describe();
  }
}

TEST(LogRecovery, RecoversEveryInstant) {
  const SampleLog sample = make_sample({.seed = 12, .commits = 60});
  SimulatedDisk disk(1, sample.contents);
  const std::int64_t end_ns = sample.history.images.at(sample.latest).latest.time.time_since_epoch().count();
  ASSERT_GT(end_ns, 20);
  for (std::int64_t time_ns = -1; time_ns <= end_ns + 1; ++time_ns) {
    const Version newest = sample.history.newest_at(world_time_ns(time_ns));
    const auto recovered = recover(disk, {.up_to_time = world_time_ns(time_ns)});
    ASSERT_TRUE(recovered.ok()) << recovered.error().message;
    ASSERT_EQ(recovered.value().world.latest.version, newest) << time_ns;
    ASSERT_TRUE(image_of(recovered.value().world) == sample.history.images.at(newest));
  }
}

TEST(LogRecovery, SalvagedLogContinuesUndamaged) {
  SampleLog sample = make_sample({.seed = 13, .commits = 40, .closed = false, .checkpoints = false});
  const auto groups = groups_of(sample.contents);
  const GroupPlace& damaged = groups[groups.size() / 2];
  sample.contents[damaged.file][damaged.offset + 100] ^= std::byte{4};
  SimulatedDisk disk(1, sample.contents);
  ASSERT_FALSE(recover(disk).ok());
  const Recovered salvaged = recover(disk, {.salvage = true}).value();
  const Version version = salvaged.world.latest.version;
  ASSERT_EQ(version, groups[groups.size() / 2 - 1].header.last_version);

  hil::tests::SimulatedClock clock;
  sample.history.forget_after(version);
  LiveWorld world(3, sample.history, 1 << 14, salvaged);
  auto writer = Writer::start(disk, clock, world.ring(), world,
                              {.segment_bytes = 8192, .checkpoint_every_bytes = 0}, start_after(salvaged, 1));
  ASSERT_TRUE(writer.ok());
  for (int k = 0; k < 5; ++k) {
    world.commit();
    write_all(*writer.value());
  }
  EXPECT_EQ(writer.value()->durable(), version + 5);
  disk.crash();
  const auto recovered = recover(disk);
  ASSERT_TRUE(recovered.ok()) << recovered.error().message;
  EXPECT_EQ(recovered.value().world.latest.version, version + 5);
  EXPECT_TRUE(image_of(recovered.value().world) == sample.history.images.at(version + 5));
}

class SalvagedWithoutAGeometry : public testing::TestWithParam<bool> {
 protected:
  /// A geometry file that checkpoints refer to is missing or damaged.
  SalvagedWithoutAGeometry()
      : sample(make_sample({.seed = 14, .commits = 40, .closed = false})),
        undamaged(sample.contents.at(file)) {
    if (GetParam())
      sample.contents.erase(file);
    else
      sample.contents.at(file)[100] ^= std::byte{1};
    disk.set_contents(sample.contents);
  }
  /// Continues the log without closing it, and returns the durable version.
  Version commit(const Recovered& salvaged, int count, std::uint64_t checkpoint_every_bytes) {
    hil::tests::SimulatedClock clock;
    sample.history.forget_after(salvaged.world.latest.version);
    LiveWorld world(3, sample.history, 1 << 14, salvaged);
    auto writer = Writer::start(disk, clock, world.ring(), world,
                                {.segment_bytes = 8192, .checkpoint_every_bytes = checkpoint_every_bytes},
                                start_after(salvaged, 1));
    EXPECT_TRUE(writer.ok());
    for (; writer.ok() && count > 0; --count) {
      world.commit();
      write_all(*writer.value());
    }
    return writer.ok() ? writer.value()->durable() : 0;
  }
  void restore_file() {
    auto contents = disk.contents();
    contents[file] = undamaged;
    disk.set_contents(contents);
  }
  void expect_world(const Result<Recovered>& recovered, Version version) {
    ASSERT_TRUE(recovered.ok()) << recovered.error().message;
    EXPECT_EQ(recovered.value().world.latest.version, version) << recovered.value().report.describe();
    EXPECT_TRUE(image_of(recovered.value().world) == sample.history.images.at(version));
  }

  const std::string file = geometry_name(9);  // the second geometry; the first checkpoint is newer
  SampleLog sample;
  const std::vector<std::byte> undamaged;
  SimulatedDisk disk{1};
};

TEST_P(SalvagedWithoutAGeometry, ContinuesFromTheWorldBeforeTheGeometry) {
  const auto refused = recover(disk);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find(file), std::string::npos) << refused.error().message;

  const auto salvaged = recover(disk, {.salvage = true});
  const Version version = salvaged.value().world.latest.version;
  EXPECT_GT(version, 2u);
  expect_world(salvaged, version);
  EXPECT_EQ(salvaged.value().world.geometries.size(), 1u);
  EXPECT_NE(salvaged.value().report.log.damage.find(file), std::string::npos);
  EXPECT_EQ(salvaged.value().report.damaged_checkpoints.size(), 2u);
  EXPECT_EQ(commit(salvaged.value(), 1, 0), version + 1);
  disk.crash();
  const auto again = recover(disk);
  expect_world(again, version + 1);
  EXPECT_TRUE(again.value().report.damaged_checkpoints.empty());
}

/// The salvaged log has set the checkpoints with the geometry aside: they stay unused, even if the file is
/// repaired.
TEST_P(SalvagedWithoutAGeometry, IgnoresOldCheckpointsWhenTheGeometryIsRestored) {
  const auto before = disk.contents();
  for (const int commits : {1, 3, 10, 30, 60, 120}) {
    for (const std::uint64_t checkpoint_every_bytes : {0u, 2000u}) {
      SCOPED_TRACE(std::to_string(commits) + " commits, a checkpoint every " +
                   std::to_string(checkpoint_every_bytes) + " bytes");
      disk.set_contents(before);
      const auto salvaged = recover(disk, {.salvage = true});
      ASSERT_TRUE(salvaged.ok());
      const Version durable = commit(salvaged.value(), commits, checkpoint_every_bytes);
      EXPECT_EQ(durable, salvaged.value().world.latest.version + static_cast<Version>(commits));
      disk.crash();
      restore_file();
      expect_world(recover(disk), durable);
      const auto again = recover(disk, {.salvage = true});
      expect_world(again, durable);
      EXPECT_EQ(commit(again.value(), 2, 0), durable + 2);
      disk.crash();
      expect_world(recover(disk), durable + 2);
    }
  }
}

/// A crash before the log is continued: no checkpoint has been set aside.
TEST_P(SalvagedWithoutAGeometry, LosesNothingBeforeItContinues) {
  const Version newest = sample.history.images.rbegin()->first;
  const auto salvaged = recover(disk, {.salvage = true});
  ASSERT_TRUE(salvaged.ok());
  disk.fail_kind(DiskCall::create, EIO);
  hil::tests::SimulatedClock clock;
  LiveWorld world(3, sample.history, 1 << 14, salvaged.value());
  EXPECT_FALSE(Writer::start(disk, clock, world.ring(), world, {}, start_after(salvaged.value(), 1)).ok());
  disk.fail_kind(DiskCall::create, 0);
  restore_file();
  expect_world(recover(disk), newest);
}

/// A checkpoint that was renamed back by hand: refused; salvage continues from it.
TEST_P(SalvagedWithoutAGeometry, RestoredCheckpointIsRefused) {
  const auto is_checkpoint = [](const auto& one) { return one.first.starts_with("checkpoint."); };
  const Version newest = sample.latest;
  History before = sample.history;
  for (const int commits : {1, 10, 60}) {
    SCOPED_TRACE(std::to_string(commits) + " commits");
    auto contents = sample.contents;
    Contents checkpoints;
    for (const auto& [name, bytes] : contents)
      if (is_checkpoint(std::pair(name, bytes))) checkpoints[name] = bytes;
    std::erase_if(contents, is_checkpoint);
    disk.set_contents(contents);
    const auto salvaged = recover(disk, {.salvage = true});
    ASSERT_TRUE(salvaged.ok());
    sample.history = before;
    const Version durable = commit(salvaged.value(), commits, 0);
    EXPECT_LT(salvaged.value().world.latest.version, newest);
    disk.crash();
    expect_world(recover(disk), durable);

    restore_file();
    contents = disk.contents();
    contents.insert(checkpoints.begin(), checkpoints.end());
    disk.set_contents(contents);
    EXPECT_FALSE(recover(disk).ok());
    sample.history = before;
    const auto again = recover(disk, {.salvage = true});
    ASSERT_TRUE(again.ok()) << again.error().message;
    const Version version = again.value().world.latest.version;
    expect_world(again, version);
    EXPECT_EQ(commit(again.value(), 3, 0), version + 3);
    disk.crash();
    expect_world(recover(disk), version + 3);
  }
}

INSTANTIATE_TEST_SUITE_P(LogRecovery, SalvagedWithoutAGeometry, testing::Bool(),
                         [](const auto& missing) { return missing.param ? "missing" : "damaged"; });

/// With salvage too: a read error may be temporary.
TEST(LogRecovery, ReadErrorIsNoDamage) {
  for (const bool checkpoints : {false, true}) {
    const SampleLog sample =
        make_sample({.seed = 14, .commits = 40, .closed = false, .checkpoints = checkpoints});
    int refused = 0;
    for (std::uint64_t call = 0;; ++call) {
      SimulatedDisk disk(1, sample.contents);
      disk.fail_call(call, EIO);
      const auto recovered = recover(disk, {.salvage = true});
      if (disk.calls() <= call) break;
      refused += recovered.ok() ? 0 : 1;
      EXPECT_EQ(recovered.ok() ? recovered.value().world.latest.version : sample.latest, sample.latest)
          << "call " << call;
    }
    EXPECT_GT(refused, 10);
  }
}

// ---- recovery that ends within a group

/// A source that has no world.
class NoWorld final : public WorldSource {
 public:
  std::optional<WorldHead> begin(Version) override { return std::nullopt; }
  bool rows(std::uint32_t, std::span<EntityState>) override { return false; }
  bool shape(GeometryId, Shape&) override { return false; }
  void end() noexcept override {}
};

store::WriteSet one_write(Version version, store::WriteKind kind) {
  return {version, world_time_ns(0), {{kind, {{0, 1}, {}, version}}}};
}

class EndWithinRecords : public testing::Test {
 protected:
  /// A writer continues the recovered log; the records of `put` are on disk at the power loss.
  void write_and_crash(const RecoveryOptions& options, const std::function<void(Recorder&)>& put) {
    Ring ring(2048);
    Recorder recorder(ring);
    const Recovered recovered = recover(disk, options).value();
    auto writer =
        Writer::start(disk, clock, ring, source, {.segment_bytes = 4096}, start_after(recovered, 1));
    ASSERT_TRUE(writer.ok());
    put(recorder);
    write_all(*writer.value());
    disk.crash();
  }

  SimulatedDisk disk{1};
  hil::tests::SimulatedClock clock;
  NoWorld source;
};

TEST_F(EndWithinRecords, VersionsBeforeAGapAreKeptWithoutACheckpoint) {
  write_and_crash({}, [](Recorder& recorder) {
    recorder.record(one_write(1, store::WriteKind::create));
    store::WriteSet too_long = one_write(2, store::WriteKind::update);
    too_long.writes.resize(12, too_long.writes[0]);
    EXPECT_FALSE(recorder.record(too_long));
    EXPECT_TRUE(recorder.record(one_write(3, store::WriteKind::update)));
  });
  for (int round = 0; round < 3; ++round) {
    const auto recovered = recover(disk);
    ASSERT_TRUE(recovered.ok()) << recovered.error().message;
    ASSERT_EQ(recovered.value().world.latest.version, 1u) << "round " << round;
    ASSERT_NO_FATAL_FAILURE(write_and_crash({}, [](Recorder&) {}));
  }
}

TEST_F(EndWithinRecords, SalvagedPartOfAGroupIsNotDurableByTheGroups) {
  write_and_crash({}, [](Recorder& recorder) {
    recorder.record(one_write(1, store::WriteKind::create));
    recorder.record(one_write(2, store::WriteKind::create));  // the index is in use
  });
  ASSERT_FALSE(recover(disk).ok());
  ASSERT_EQ(recover(disk, {.salvage = true}).value().world.latest.version, 1u);
  write_and_crash({.salvage = true},
                  [](Recorder& recorder) { recorder.record(one_write(2, store::WriteKind::update)); });
  const auto recovered = recover(disk);
  ASSERT_TRUE(recovered.ok()) << recovered.error().message;
  EXPECT_EQ(recovered.value().world.latest.version, 0u);
  EXPECT_EQ(recovered.value().report.gap_from, 1u);
  EXPECT_EQ(recovered.value().report.gap_to, 1u);
}

// ---- a store that continues

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
  row.material = 5;
  store::WriteSet set{1, world_time_ns(10), {{store::WriteKind::create, {{0, 1}, row, 1}}}};
  ASSERT_EQ(world.apply(set), nullptr);
  row.material = 6;
  store::Write moves{store::WriteKind::update_motion, {{0, 1}, {}, 2}};
  moves.state.row.motion.p_world_m.y = 5.0;
  set = {2, world_time_ns(20), {{store::WriteKind::update, {{0, 1}, row, 2}}, moves, moves}};
  set.writes[2].kind = store::WriteKind::remove;
  ASSERT_EQ(world.apply(set), nullptr);
  EXPECT_EQ(set.writes[0].state.row.material, 6u);
  EXPECT_EQ(set.writes[0].state.row.motion.p_world_m.y, 0.0);
  EXPECT_EQ(set.writes[1].state.row.material, 6u);
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
