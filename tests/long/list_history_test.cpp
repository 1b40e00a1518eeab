// The check of histories finds every anomaly, and none in a serial history.

#include "tests/long/list_history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace hil::long_test {
namespace {

using History = std::vector<RecordedTransaction>;

RecordedTransaction lasting(std::int64_t begun_ns, std::int64_t ended_ns, std::vector<Append> appends,
                            std::vector<ListRead> reads = {}) {
  RecordedTransaction made;
  made.begun_ns = begun_ns;
  made.ended_ns = ended_ns;
  made.appends = std::move(appends);
  made.reads = std::move(reads);
  return made;
}

/// All of these overlap, so that real time orders none of them.
RecordedTransaction overlapping(std::vector<Append> appends, std::vector<ListRead> reads = {}) {
  return lasting(0, 100, std::move(appends), std::move(reads));
}

RecordedTransaction read_first(std::vector<Append> appends, std::vector<ListRead> reads) {
  RecordedTransaction made = overlapping(std::move(appends), std::move(reads));
  made.reads_before_appends = true;
  return made;
}

RecordedTransaction uncommitted(std::vector<Append> appends) {
  RecordedTransaction made = overlapping(std::move(appends));
  made.committed = false;
  return made;
}

RecordedTransaction old_version(RecordedTransaction made) {
  made.reads_old_version = true;
  return made;
}

TEST(ListHistory, FindsEveryAnomaly) {
  const RecordedTransaction append_10 = lasting(0, 1, {{1, 10}});
  const RecordedTransaction stale = lasting(2, 3, {}, {{1, {}}});
  const RecordedTransaction final_read = lasting(4, 5, {}, {{1, {10}}});
  const struct {
    const char* name;
    std::optional<Anomaly> anomaly;
    History history;
  } cases[] = {
      {"empty", {}, {}},
      {"serial",
       {},
       {append_10, lasting(2, 3, {{1, 11}}, {{1, {10, 11}}}), lasting(4, 5, {}, {{1, {10, 11}}})}},
      {"unwritten value", Anomaly::unwritten_value, {overlapping({}, {{1, {7}}})}},
      {"repeated value", Anomaly::repeated_value, {overlapping({{1, 7}}), overlapping({}, {{1, {7, 7}}})}},
      {"aborted read", Anomaly::aborted_read, {uncommitted({{1, 7}}), overlapping({}, {{1, {7}}})}},
      {"partial read", Anomaly::partial_read, {overlapping({{1, 7}, {1, 8}}), overlapping({}, {{1, {7}}})}},
      {"appends not read", Anomaly::misplaced_appends, {overlapping({{1, 7}}, {{1, {}}})}},
      {"read before appends", {}, {read_first({{1, 7}}, {{1, {}}}), overlapping({}, {{1, {7}}})}},
      {"appends read too early", Anomaly::misplaced_appends, {read_first({{1, 7}}, {{1, {7}}})}},
      {"conflicting reads",
       Anomaly::conflicting_reads,
       {overlapping({{1, 7}}), overlapping({{1, 8}}), overlapping({}, {{1, {7, 8}}}),
        overlapping({}, {{1, {8, 7}}})}},
      {"lost append",
       Anomaly::lost_append,
       {overlapping({{1, 7}}), overlapping({{1, 8}}), lasting(200, 201, {}, {{1, {8}}})}},
      {"lost update",
       Anomaly::cycle,
       {read_first({{1, 7}}, {{1, {}}}), read_first({{1, 8}}, {{1, {}}}), overlapping({}, {{1, {7, 8}}})}},
      {"cycle of writes",
       Anomaly::cycle,
       {overlapping({{1, 10}, {2, 20}}), overlapping({{1, 11}, {2, 21}}), overlapping({}, {{1, {10, 11}}}),
        overlapping({}, {{2, {21, 20}}})}},
      {"cycle of writes and reads",
       Anomaly::cycle,
       {overlapping({{1, 10}}, {{2, {20}}}), overlapping({{2, 20}}, {{1, {10}}})}},
      {"read skew",
       Anomaly::cycle,
       {overlapping({{1, 10}, {2, 20}}), overlapping({}, {{1, {}}, {2, {20}}}),
        overlapping({}, {{1, {10}}})}},
      {"write skew",
       Anomaly::cycle,
       {overlapping({{1, 10}}, {{2, {}}}), overlapping({{2, 20}}, {{1, {}}}),
        overlapping({}, {{1, {10}}, {2, {20}}})}},
      {"stale read", Anomaly::cycle, {append_10, stale, final_read}},
      {"read of an old version", {}, {append_10, old_version(stale), final_read}}};
  for (const auto& one : cases) {
    const auto found = find_anomaly(one.history);
    EXPECT_EQ(found.has_value(), one.anomaly.has_value()) << one.name;
    if (found && one.anomaly) {
      EXPECT_EQ(found->anomaly, *one.anomaly) << one.name << ": " << found->text;
    }
  }
}

/// A serial execution by a model, whose transactions overlap in time.
History serial_history(std::uint32_t seed, std::size_t transactions) {
  std::mt19937 random(seed);
  std::vector<std::vector<Value>> lists(8);
  History history;
  Value next_value = 1;
  for (std::size_t k = 0; k < transactions; ++k) {
    const auto instant = static_cast<std::int64_t>(10 * k);
    RecordedTransaction one = lasting(instant - static_cast<std::int64_t>(random() % 50),
                                      instant + static_cast<std::int64_t>(random() % 50), {});
    for (auto n = random() % 3; n > 0; --n) {
      const auto key = static_cast<Key>(random() % 8);
      one.appends.push_back({key, next_value});
      lists[key].push_back(next_value++);
    }
    for (auto n = random() % 3; n > 0; --n) {
      const auto key = static_cast<Key>(random() % 8);
      one.reads.push_back({key, lists[key]});
    }
    history.push_back(std::move(one));
  }
  RecordedTransaction last = lasting(static_cast<std::int64_t>(10 * transactions + 100),
                                     static_cast<std::int64_t>(10 * transactions + 101), {});
  for (Key key = 0; key < 8; ++key)
    last.reads.push_back({key, lists[key]});
  history.push_back(std::move(last));
  return history;
}

TEST(ListHistory, FindsNoneInASerialHistoryInAnyOrderOfItsRecords) {
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    History history = serial_history(seed, 300);
    std::ranges::shuffle(history, std::mt19937(seed));
    const auto found = find_anomaly(history);
    ASSERT_FALSE(found) << "seed " << seed << ": " << found->text;
  }
}

TEST(ListHistory, FindsOneStaleReadAmongHundreds) {
  std::size_t found = 0;
  std::size_t tried = 0;
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    History history = serial_history(seed, 300);
    std::mt19937 random(seed + 1000);
    RecordedTransaction& one = history[100 + random() % 100];
    if (one.reads.empty() || !one.appends.empty() || one.reads[0].values.size() < 12) continue;
    one.reads[0].values.resize(one.reads[0].values.size() - 10);  // ten appends ended before it began
    ++tried;
    found += find_anomaly(history) ? 1 : 0;
  }
  EXPECT_GT(tried, 20u);
  EXPECT_EQ(found, tried);
}

}  // namespace
}  // namespace hil::long_test
