// Collected records are put into the ring completely and in order, and always fit.

#include "rtstdb/log/recorder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "random_sets.hpp"

namespace rtstdb::log::test {
namespace {

/// A commit that moves some entities.
store::WriteSet moves(RandomSets& random, Version version, std::uint32_t writes, WorldTime time = {}) {
  store::WriteSet set{version, time, {}};
  for (std::uint32_t k = 0; k < writes; ++k)
    set.writes.push_back({store::WriteKind::update_motion, {{k, 1}, random.row(), version}});
  return set;
}

/// Takes all visible records in order, while the recorder does nothing.
class Taker {
 public:
  explicit Taker(Ring& ring) : ring_(ring) {}

  void take() {
    // Twice, since the records may wrap around.
    for (int k = 0; k < 2; ++k) {
      const auto records = ring_.view();
      for (std::size_t place = 0; place < records.size(); place += decoder_.bytes()) {
        const char* fault = decoder_.decode(records.subspan(place));
        ASSERT_EQ(fault, nullptr) << fault;
        const Record& record = decoder_.record();
        if (record.kind == RecordKind::discarded) continue;
        versions.push_back(record.kind == RecordKind::gap ? record.to : record.commit.version);
        if (record.kind == RecordKind::commit) times[record.commit.version] = record.commit.time;
      }
      ring_.release(records.size());
    }
  }

  std::vector<Version> versions;  ///< of commits, and the last version of each gap
  std::map<Version, WorldTime> times;

 private:
  Ring& ring_;
  RecordDecoder decoder_;
};

TEST(LogRecorder, KeepsCollectedRecordsUntilFlush) {
  RandomSets random(1);
  Ring ring(std::size_t{1} << 16);
  Recorder recorder(ring);
  EXPECT_FALSE(recorder.flush()) << "nothing is collected";
  Taker taker(ring);
  for (Version version = 1; version <= 3; ++version)
    ASSERT_TRUE(recorder.collect(moves(random, version, 1)));
  EXPECT_EQ(recorder.records(), 3u);
  taker.take();
  EXPECT_TRUE(taker.versions.empty());
  EXPECT_TRUE(recorder.flush());
  EXPECT_FALSE(recorder.flush());
  taker.take();
  EXPECT_EQ(taker.versions, (std::vector<Version>{1, 2, 3}));
}

TEST(LogRecorder, OtherRecordsFollowCollectedOnes) {
  RandomSets random(2);
  Ring ring(std::size_t{1} << 16);
  Recorder recorder(ring);
  ASSERT_TRUE(recorder.collect(moves(random, 1, 1)));
  ASSERT_TRUE(recorder.record(moves(random, 2, 1)));
  Taker taker(ring);
  taker.take();
  EXPECT_EQ(taker.versions, (std::vector<Version>{1, 2}));
  const LoggedGeometry geometry{{0}, "box", {}, 1, 2};
  ASSERT_TRUE(recorder.collect(moves(random, 3, 1)));
  ASSERT_TRUE(recorder.record(geometry));
  RecordDecoder decoder(WorldTime{});  // world time of the previous commits
  ASSERT_EQ(decoder.decode(ring.view()), nullptr);
  EXPECT_EQ(decoder.record().kind, RecordKind::commit);
  ASSERT_TRUE(recorder.collect(moves(random, 4, 1)));
  recorder.discard(4);
  auto left = ring.view();
  RecordKind kinds[4] = {};
  for (RecordKind& kind : kinds) {
    ASSERT_EQ(decoder.decode(left), nullptr);
    kind = decoder.record().kind;
    left = left.subspan(decoder.bytes());
  }
  EXPECT_EQ(kinds[1], RecordKind::geometry);
  EXPECT_EQ(kinds[2], RecordKind::commit);
  EXPECT_EQ(kinds[3], RecordKind::discarded);
  EXPECT_TRUE(left.empty());
}

TEST(LogRecorder, DoesNotCollectLargeRecords) {
  RandomSets random(3);
  Ring ring(std::size_t{1} << 16);
  Recorder recorder(ring);
  EXPECT_FALSE(recorder.collect(moves(random, 1, 100)));
  EXPECT_EQ(recorder.records(), 0u);
  Version version = 1;
  while (recorder.collect(moves(random, version, 1)))
    ++version;
  EXPECT_GT(version, 4u) << "several small records fit";
  EXPECT_LT(version, 100u) << "the memory is limited";
}

TEST(LogRecorder, LosesNoVersionInRandomOrders) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    RandomSets random(seed);
    Ring ring(1024 + 8 * random.below(2000));
    Recorder recorder(ring);
    Taker taker(ring);
    std::vector<Version> expected;
    std::int64_t time_ns = 0;
    std::map<Version, WorldTime> times;
    for (Version version = 1; version <= 2000; ++version) {
      time_ns += random.below(2);
      const store::WriteSet set = moves(random, version, 1 + random.below(3) / 2, world_time_ns(time_ns));
      const bool collected = random.below(4) != 0 && recorder.collect(set);
      if (collected || recorder.record(set)) {
        expected.push_back(version);
        times[version] = set.time;
        if (random.below(20) == 0) recorder.discard(version);
      }
      if (random.below(5) == 0) recorder.flush();
      if (random.below(7) == 0) taker.take();
      if (random.below(9) == 0) recorder.maintain();
    }
    for (int k = 0; k < 3; ++k) {
      recorder.maintain();
      taker.take();
    }
    ASSERT_FALSE(recorder.in_gap());
    ASSERT_TRUE(std::ranges::is_sorted(taker.versions)) << "seed " << seed;
    // Versions that were not recorded are in gaps; each gap counts with its last version.
    ASSERT_TRUE(std::ranges::includes(taker.versions, expected)) << "seed " << seed;
    EXPECT_EQ(recorder.gap_versions(), 2000 - expected.size()) << "seed " << seed;
    ASSERT_EQ(taker.times, times) << "seed " << seed;
  }
}

}  // namespace
}  // namespace rtstdb::log::test
