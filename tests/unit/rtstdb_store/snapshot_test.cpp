// Refused reads of older versions, and the changes between two versions. model_test.cpp reads all versions.

#include <gtest/gtest.h>

#include <algorithm>

#include "rows.hpp"

namespace rtstdb::store::test {
namespace {

Snapshot read(const Store& store, const ReadAt& at) {
  return std::get<Snapshot>(store.read(at));
}
BadInput refused(const Store& store, const ReadAt& at) {
  return std::get<BadInput>(store.read(at));
}

class ThreeVersions : public testing::Test {
 protected:
  // version 1 at 10 ns: a; 2 at 20: a moved, b; 3 at 20: a removed
  void SetUp() override {
    ASSERT_FALSE(commit(store_, set_of(10, {create(row_at(1))})));
    ASSERT_FALSE(commit(store_, set_of(20, {update({0, 1}, row_at(2)), create(row_at(3))})));
    ASSERT_FALSE(commit(store_, set_of(20, {remove({0, 1})})));
  }
  Store store_{options(8)};
};

TEST_F(ThreeVersions, AreReadAsOfAnyTimeBeforeTheEndOfHistory) {
  EXPECT_EQ(read(store_, ReadAt::as_of(world_time_ns(20))).version(), 3u) << "the later one of equal times";
  EXPECT_EQ(read(store_, ReadAt::as_of(WorldTime::max())).version(), 3u);
  store_.end_history_at(world_time_ns(25));
  EXPECT_EQ(read(store_, ReadAt::as_of(world_time_ns(24))).version(), 3u);
  EXPECT_EQ(refused(store_, ReadAt::as_of(world_time_ns(25))).reason, BadInputReason::beyond_history);
  EXPECT_EQ(refused(store_, ReadAt::as_of(WorldTime::max())).reason, BadInputReason::beyond_history);
}

TEST_F(ThreeVersions, RefuseUnknownVersions) {
  const BadInput fault = refused(store_, ReadAt::pinned(4));
  EXPECT_EQ(fault.reason, BadInputReason::unknown_version);
  EXPECT_EQ(fault.values[0], 4.0);
  EXPECT_EQ(fault.values[1], 0.0);
  EXPECT_EQ(refused(store_, ReadAt::as_of(WorldTime::min())).reason, BadInputReason::unknown_version);
}

TEST(Snapshots, AreNoLongerKeptAfterManyCommits) {
  Store store(options(8, 4));
  ASSERT_FALSE(commit(store, set_of(1'000'000'000, {create(row_at(0))})));
  const Snapshot first = store.latest_snapshot();
  for (int k = 1; k <= 4; ++k) {
    ASSERT_FALSE(commit(store, set_of((1 + k) * 1'000'000'000LL, {update({0, 1}, row_at(k))})));
    ASSERT_TRUE(first.still_kept());
    ASSERT_EQ(first.row(0)->row.mask, 0u) << "after " << k << " later commits";
  }
  ASSERT_FALSE(commit(store, set_of(6'000'000'000, {update({0, 1}, row_at(5))})));
  EXPECT_FALSE(first.still_kept());
  EXPECT_DEATH(static_cast<void>(first.row(0)),
               "assertion failed: the version is older than the retained ones");

  const BadInput by_number = refused(store, ReadAt::pinned(1));
  EXPECT_EQ(by_number.reason, BadInputReason::snapshot_too_old);
  EXPECT_EQ(by_number.values[0], 1.0);
  EXPECT_EQ(by_number.values[1], 2.0);
  const BadInput by_time = refused(store, ReadAt::as_of(world_time_ns(1'500'000'000)));
  EXPECT_EQ(by_time.reason, BadInputReason::snapshot_too_old);
  EXPECT_EQ(by_time.values[0], -1.0);
  EXPECT_DOUBLE_EQ(by_time.values[2], 1.5);
  EXPECT_DOUBLE_EQ(by_time.values[3], 2.0);
  EXPECT_EQ(read(store, ReadAt::as_of(world_time_ns(2'500'000'000))).find({0, 1})->row.mask, 1u);
}

std::optional<std::vector<std::uint32_t>> changed(const Snapshot& here, Version other) {
  std::vector<std::uint32_t> indices;
  indices.reserve(here.index_limit());
  if (!here.changed_between(other, indices)) return std::nullopt;
  EXPECT_LE(indices.size(), here.index_limit());
  std::sort(indices.begin(), indices.end());
  return indices;
}

using Indices = std::vector<std::uint32_t>;

TEST_F(ThreeVersions, HaveChangesInBothDirections) {
  EXPECT_EQ(changed(read(store_, ReadAt::latest()), 3), Indices{});
  EXPECT_EQ(changed(read(store_, ReadAt::latest()), 2), (Indices{0}));
  EXPECT_EQ(changed(read(store_, ReadAt::latest()), 1), (Indices{0, 1}));
  EXPECT_EQ(changed(read(store_, ReadAt::pinned(1)), 3), (Indices{0, 1}));
  EXPECT_EQ(changed(read(store_, ReadAt::pinned(1)), 0), (Indices{0}));
  EXPECT_FALSE(changed(read(store_, ReadAt::latest()), 99)) << "an unknown version";
}

TEST_F(ThreeVersions, HaveChangesToStagedAndDiscardedVersions) {
  WriteSet set = set_of(30, {create(row_at(5)), create(row_at(6))});
  ASSERT_FALSE(store_.stage(set));
  EXPECT_EQ(changed(store_.staged_snapshot(), 3), (Indices{0, 2}));
  EXPECT_EQ(changed(store_.staged_snapshot(), 2), (Indices{0, 2}));
  EXPECT_EQ(changed(store_.latest_snapshot(), set.version), (Indices{0, 2}));
  store_.discard();
  // A device that has the discarded version must replace those rows for each later version.
  EXPECT_EQ(changed(store_.latest_snapshot(), set.version), (Indices{0, 2}));
  EXPECT_EQ(changed(read(store_, ReadAt::pinned(2)), set.version), (Indices{0, 2}));
  ASSERT_FALSE(commit(store_, set_of(30, {update({1, 1}, row_at(9))})));
  EXPECT_EQ(changed(store_.latest_snapshot(), set.version), (Indices{0, 1, 2}));
  EXPECT_EQ(changed(store_.latest_snapshot(), 3), (Indices{1}));
}

TEST(Snapshots, RefuseChangesThatAreNotKept) {
  Store store(options(8, 2));
  ASSERT_FALSE(commit(store, set_of(1, {create(row_at(1)), create(row_at(2))})));
  WriteSet discarded = set_of(1, {update({0, 1}, row_at(3))});
  ASSERT_FALSE(store.stage(discarded));
  store.discard();
  EXPECT_TRUE(changed(store.latest_snapshot(), discarded.version));
  for (int k = 0; k < 2; ++k) {
    WriteSet more = set_of(1, {update({0, 1}, row_at(4)), update({1, 1}, row_at(4))});
    ASSERT_FALSE(store.stage(more));
    store.discard();
  }
  EXPECT_FALSE(changed(store.latest_snapshot(), discarded.version));
  EXPECT_EQ(changed(store.latest_snapshot(), 4), (Indices{0, 1}));
  EXPECT_EQ(store.latest_snapshot().row(0)->row.mask, 1u) << "discards use no history";
  EXPECT_EQ(store.oldest_kept(), 0u);
  for (int k = 0; k < 3; ++k)
    ASSERT_FALSE(commit(store, set_of(1, {update({0, 1}, row_at(k))})));
  EXPECT_FALSE(changed(store.latest_snapshot(), 1));
}

}  // namespace
}  // namespace rtstdb::store::test
