// Recovery of each version and instant, from a disk with read errors, and of a log that ends within a group.

#include "rtstdb/log/recovery.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "rtstdb/log/writer.hpp"
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

}  // namespace
}  // namespace rtstdb::log::test
