// The writer on a simulated disk: when it writes, when the durable version advances, and how it handles
// faults.

#include "rtstdb/log/writer.hpp"

#include <gtest/gtest.h>

#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/version_range.hpp"
#include "tests/support/allocation_guard.hpp"
#include "writer_fixture.hpp"

namespace rtstdb::log::test {
namespace {

/// The disk has space for the data but not for a preallocated segment.
TEST_F(WriterTest, LogContinuesOnANearlyFullDisk) {
  start({.segment_bytes = 1 << 16, .checkpoint_every_bytes = 0});
  commit(5);
  ASSERT_TRUE(writer->close(0).ok());
  std::uint64_t used = 0;
  for (const auto& [name, bytes] : disk.contents())
    used += bytes.size();
  disk.set_capacity(used + 8192);
  start({.segment_bytes = 1 << 16, .checkpoint_every_bytes = 0});
  EXPECT_EQ(writer->durable(), 5u);
  commit(2);
  settle();
  EXPECT_EQ(writer->durable(), 7u);
  EXPECT_EQ(writer->statistics().faults, 0u);
  EXPECT_EQ(version_after_crash(), 7u);
  EXPECT_EQ(recover(disk).value().report.log.end, LogEnd::end_of_data)
      << "a file that grows is as long as what was written";
}

TEST_F(WriterTest, FullSegmentIsFollowedByANewOne) {
  start({.segment_bytes = 4096, .checkpoint_every_bytes = 0});
  for (int k = 0; k < 50; ++k) {
    commit(1);
    writer->step(0);
  }
  EXPECT_GT(writer->statistics().segments, 3u);
  for (const auto& [name, bytes] : disk.contents())
    EXPECT_LE(bytes.size(), 4096u) << name;
  EXPECT_EQ(version_after_crash(), 50u);
}

TEST_F(WriterTest, RecordsWaitForTheFlushInterval) {
  start({.segment_bytes = 8192, .checkpoint_every_bytes = 0, .flush_interval = Nanoseconds(5'000'000)});
  commit(1);
  settle();
  EXPECT_EQ(writer->durable(), 1u);
  commit(1);
  const Writer::Step step = writer->step(0);
  EXPECT_FALSE(step.worked);
  EXPECT_EQ(step.wake_at, clock.now() + Nanoseconds(5'000'000));
  clock.advance(Nanoseconds(4'999'999));
  settle();
  EXPECT_EQ(writer->durable(), 1u);
  clock.advance(Nanoseconds(1));
  settle();
  EXPECT_EQ(writer->durable(), 2u);
  commit(1);
  writer->flush_soon();
  settle();
  EXPECT_EQ(writer->durable(), 3u);
}

TEST_F(WriterTest, CheckpointShortensRecovery) {
  start({.segment_bytes = 1 << 16, .checkpoint_every_bytes = 8192, .rows_per_slice = 3});
  for (int k = 0; k < 60; ++k) {
    commit(1);
    writer->step(0);
  }
  settle();
  EXPECT_GE(writer->statistics().checkpoints, 2u);
  EXPECT_EQ(version_after_crash(), 60u);
  const RecoveryReport report = recover(disk).value().report;
  EXPECT_GT(report.checkpoint, 1u);
  EXPECT_LT(report.versions, 40u);
}

TEST_F(WriterTest, CheckpointDoesNotWaitForADiscardedVersion) {
  start();
  commit(2);
  world.commit_and_discard();
  settle();
  writer->checkpoint_soon();
  settle();
  EXPECT_EQ(writer->statistics().checkpoints, 1u);
  EXPECT_EQ(version_after_crash(), 2u);
}

// ---- faults

/// The position of a checkpoint must not be between a commit and the record that discards it.
TEST_F(WriterTest, CheckpointDoesNotBeginBeforeADiscardRecord) {
  start({.segment_bytes = 8192, .checkpoint_every_bytes = 0, .flush_interval = Nanoseconds(3'000'000)});
  commit(1);
  settle();
  clock.advance(Nanoseconds(3'000'000));
  world.commit_and_discard([this] { writer->step(0); });
  ASSERT_EQ(writer->records_on_disk(), 2u) << "only the commit";
  writer->checkpoint_soon();
  settle();
  clock.advance(Nanoseconds(3'000'000));
  settle();
  EXPECT_EQ(writer->records_on_disk(), 3u);
  settle();
  EXPECT_EQ(writer->statistics().checkpoints, 1u);
  EXPECT_EQ(version_after_crash(), 1u);
}

/// Otherwise an older checkpoint and the log would not lead to the world of the newest checkpoint.
TEST_F(WriterTest, CheckpointWaitsForItsGeometries) {
  start({.segment_bytes = 8192, .checkpoint_every_bytes = 0, .flush_interval = Nanoseconds(3'000'000)});
  commit(2);
  settle();
  ASSERT_EQ(writer->durable(), 2u);
  ASSERT_TRUE(world.add_geometry(disk, database_id, 1));
  writer->checkpoint_soon();
  settle();
  EXPECT_EQ(writer->records_on_disk(), 2u);
  EXPECT_EQ(writer->statistics().checkpoints, 0u);
  clock.advance(Nanoseconds(3'000'000));
  settle();
  EXPECT_EQ(writer->records_on_disk(), 3u);
  EXPECT_EQ(writer->statistics().checkpoints, 1u);
  start();  // continues the log that has it
  writer->checkpoint_soon();
  settle();
  EXPECT_EQ(writer->statistics().checkpoints, 1u);
}

TEST_F(WriterTest, FailedSyncHoldsTheDurableVersionUntilACheckpoint) {
  start();
  commit(2);
  settle();
  commit(2);
  disk.fail_kind(DiskCall::sync, EIO);
  settle();
  EXPECT_EQ(writer->durable(), 2u);
  EXPECT_EQ(writer->statistics().last_fault, "sync of segment.0000000001: Input/output error");
  EXPECT_TRUE(writer->statistics().waits_for_checkpoint);
  const auto distrusted = disk.contents().at("segment.0000000001");
  disk.fail_kind(DiskCall::sync, 0);
  settle();
  EXPECT_EQ(writer->durable(), 2u) << "the retry is not due yet";
  clock.advance(Nanoseconds(1'000'000'000));
  writer->step(0);
  EXPECT_EQ(writer->durable(), 2u) << "the checkpoint is not finished";
  settle();
  EXPECT_EQ(writer->durable(), 4u);
  EXPECT_EQ(writer->statistics().checkpoints, 1u);
  EXPECT_FALSE(writer->statistics().waits_for_checkpoint);
  EXPECT_EQ(writer->statistics().segments, 2u);
  EXPECT_EQ(disk.contents().at("segment.0000000001"), distrusted);
  EXPECT_EQ(version_after_crash(), 4u);
}

// The disk works again just when the log is closed: then all records are on disk.
TEST_F(WriterTest, CloseRetriesWithoutWaiting) {
  start();
  commit(2);
  disk.fail_call(disk.calls() + 1, EIO);  // the sync of its group
  settle();
  clock.advance(Nanoseconds(1'000'000'000));
  writer->step(0);  // the group again, in a new segment
  disk.fail_kind(DiskCall::rename, EIO);
  settle();
  disk.fail_kind(DiskCall::rename, 0);
  ASSERT_TRUE(writer->waits_for_checkpoint());
  EXPECT_TRUE(writer->close(0).ok()) << writer->statistics().last_fault;
  EXPECT_EQ(version_after_crash(), 2u);
}

TEST_F(WriterTest, CheckpointBegunBeforeAFaultDoesNotCount) {
  start();
  commit(3);
  settle();
  writer->checkpoint_soon();
  ASSERT_TRUE(writer->step(0).worked);
  commit(1);
  disk.fail_call(disk.calls() + 1, EIO);  // the sync of its group
  settle();
  EXPECT_TRUE(writer->last_write_failed());
  EXPECT_TRUE(writer->waits_for_checkpoint());
  EXPECT_EQ(writer->durable(), 3u);
  EXPECT_EQ(writer->statistics().checkpoints, 0u);
  clock.advance(Nanoseconds(20'000'000));
  settle();
  EXPECT_FALSE(writer->last_write_failed());
  EXPECT_EQ(writer->durable(), 4u);
  EXPECT_EQ(writer->statistics().checkpoints, 1u);
  EXPECT_EQ(version_after_crash(), 4u);
}

TEST_F(WriterTest, FullDiskIsRetriedAtGrowingIntervals) {
  start();
  commit(2);
  settle();
  disk.set_capacity(0);
  ClockTime before = clock.now();
  Nanoseconds longest{0};
  for (int k = 0; k < 400; ++k) {
    if (k % 20 == 0) commit(2);
    const std::uint64_t faults = writer->statistics().faults;
    writer->step(0);
    if (writer->statistics().faults != faults) {
      longest = std::max(longest, clock.now() - before);
      before = clock.now();
    }
    clock.advance(Nanoseconds(10'000'000));
  }
  EXPECT_LT(writer->durable(), world.latest() - 10) << "the disk is full before that";
  EXPECT_NE(writer->statistics().last_fault.find("No space left on device"), std::string::npos);
  EXPECT_LT(writer->statistics().faults, 20u);
  EXPECT_GE(longest, Nanoseconds(900'000'000));
  disk.set_capacity(~std::uint64_t{0});
  clock.advance(Nanoseconds(2'000'000'000));
  settle();
  EXPECT_EQ(writer->durable(), world.latest());
  EXPECT_EQ(version_after_crash(), world.latest());
}

class SmallRing : public WriterTest {
 protected:
  SmallRing() : WriterTest(2048) {}
};

TEST_F(SmallRing, CrashWithinAGapLeavesTheWorldBefore) {
  start();
  commit(40);
  settle();
  const Version before_gap = writer->durable();
  world.recorder().maintain();
  commit(2);
  writer->step(0);
  writer.reset();
  EXPECT_EQ(version_after_crash(), before_gap);
  const RecoveryReport report = recover(disk).value().report;
  EXPECT_EQ(report.gap_from, before_gap + 1);
  EXPECT_EQ(report.gap_to, 40u);
  EXPECT_NE(report.describe().find("are not in the log"), std::string::npos);
}

// ---- the committing thread

TEST_F(WriterTest, RecordingNeitherAllocatesNorUsesTheDisk) {
  start();
  std::mutex mutex;
  std::condition_variable changed;
  bool stalled = true;
  bool waiting = false;
  const std::thread::id here = std::this_thread::get_id();
  bool called_here = false;
  disk.before_each([&](DiskCall) {
    std::unique_lock lock(mutex);
    if (std::this_thread::get_id() == here) called_here = true;
    waiting = true;
    changed.notify_all();
    changed.wait(lock, [&] { return !stalled; });
  });
  commit(1);
  std::thread writing([&] { settle(); });
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return waiting; });
  }
  store::WriteSet set{world.latest() + 1, world_time_ns(100), {{store::WriteKind::remove, {{0, 1}, {}, 2}}}};
  hil::allocation_guard::reset();
  hil::allocation_guard::enter_tick();
  for (int k = 0; k < 2000; ++k, ++set.version)
    world.recorder().record(set);
  world.recorder().maintain();
  hil::allocation_guard::leave_tick();
  EXPECT_EQ(hil::allocation_guard::seen().total(), 0u);
  EXPECT_TRUE(world.recorder().in_gap());
  EXPECT_EQ(writer->durable(), 0u);
  {
    const std::lock_guard lock(mutex);
    stalled = false;
  }
  changed.notify_all();
  writing.join();
  EXPECT_FALSE(called_here);
  EXPECT_GT(writer->statistics().ring_high_water, writer->statistics().ring_bytes * 9 / 10);
}

}  // namespace
}  // namespace rtstdb::log::test
