#include "rtstdb/log/prune.hpp"

#include <gtest/gtest.h>

#include <cerrno>

#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/version_range.hpp"
#include "writer_fixture.hpp"

namespace rtstdb::log::test {
namespace {

class PruneTest : public WriterTest {};

TEST_F(PruneTest, FilesBeforeTheOlderCheckpointArePruned) {
  const WriterOptions options{.segment_bytes = 2048, .checkpoint_every_bytes = 4096, .prune = true};
  start(options);
  for (int k = 0; k < 400; ++k) {
    commit(1);
    settle();
  }
  const auto listing = list_log(disk).value();
  EXPECT_EQ(listing.checkpoints.size(), 2u);
  EXPECT_GT(listing.segments.front(), 10u);
  EXPECT_LT(listing.segments.size(), 20u);
  EXPECT_EQ(writer->statistics().pruned_segments, listing.segments.front() - 1);
  const Version oldest = read_checkpoint_header(disk, listing.checkpoints.front()).value().version;
  EXPECT_EQ(read_extent(disk, false).value().first.version, oldest);
  EXPECT_EQ(version_after_crash(), 400u);
  // The older of the two is used if the newer one is damaged.
  auto contents = disk.contents();
  contents[checkpoint_name(listing.checkpoints.back())][40] ^= std::byte{1};
  disk.set_contents(contents);
  EXPECT_EQ(recover(disk).value().world.latest.version, 400u);
  start(options);
  EXPECT_EQ(writer->durable(), 400u);
}

TEST_F(PruneTest, CrashDuringPruningLeavesAReadableLog) {
  start();
  start();  // the first segments have no groups, and each begins with group 1
  start({.segment_bytes = 2048, .checkpoint_every_bytes = 4096});
  for (int k = 0; k < 100; ++k) {
    commit(1);
    settle();
  }
  writer.reset();
  const auto contents = disk.contents();
  std::uint64_t removed = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    for (std::uint64_t call = 1; call <= 20; ++call) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", call " + std::to_string(call));
      SimulatedDisk crashing(seed);
      crashing.set_contents(contents);
      crashing.fail_call(call, EIO);
      const auto pruned = prune_log(crashing);
      crashing.crash();
      removed += contents.size() - crashing.contents().size();
      const auto extent = read_extent(crashing, false);
      ASSERT_TRUE(extent.ok()) << extent.error().message;
      EXPECT_EQ(extent.value().last.version, 100u);
      EXPECT_EQ(recover(crashing).value().world.latest.version, 100u);
    }
  }
  EXPECT_GT(removed, 1000u);
}

TEST_F(PruneTest, NothingIsPrunedByDefault) {
  start({.segment_bytes = 2048, .checkpoint_every_bytes = 4096});
  for (int k = 0; k < 100; ++k) {
    commit(1);
    settle();
  }
  EXPECT_EQ(list_log(disk).value().segments.front(), 1u);
  EXPECT_EQ(writer->statistics().pruned_segments, 0u);
}

}  // namespace
}  // namespace rtstdb::log::test
