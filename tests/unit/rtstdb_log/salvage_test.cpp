// Salvaged logs: how they continue, and which checkpoints they use.

#include <gtest/gtest.h>

#include "rtstdb/log/recovery.hpp"
#include "rtstdb/log/writer.hpp"
#include "sample_log.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

using hil::tests::SimulatedDisk;

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

}  // namespace
}  // namespace rtstdb::log::test
