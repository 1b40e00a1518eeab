// The judge itself: every anomaly is found where it is, and a history without one is let pass.

#include "tests/long/list_history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace hil::stress {
namespace {

/// A transaction that lasted from one instant to another.
Recorded lasting(std::int64_t begun_ns, std::int64_t ended_ns, std::vector<Append> appends,
                 std::vector<ListRead> reads = {}) {
  Recorded made;
  made.begun_ns = begun_ns;
  made.ended_ns = ended_ns;
  made.appends = std::move(appends);
  made.reads = std::move(reads);
  return made;
}

/// All at once, so that real time orders nothing.
Recorded at_once(std::vector<Append> appends, std::vector<ListRead> reads = {}) {
  return lasting(0, 100, std::move(appends), std::move(reads));
}

std::vector<Anomaly> anomalies(const std::vector<Recorded>& history, bool final_reads = false) {
  std::vector<Anomaly> found;
  for (const Finding& finding : find_anomalies(history, {.final_reads = final_reads}))
    found.push_back(finding.anomaly);
  return found;
}

TEST(ListHistory, AnEmptyOneAndASerialOnePass) {
  EXPECT_TRUE(anomalies({}).empty());
  EXPECT_TRUE(anomalies({lasting(0, 1, {{1, 10}}), lasting(2, 3, {{1, 11}}, {{1, {10, 11}}}),
                         lasting(4, 5, {}, {{1, {10, 11}}})},
                        true)
                  .empty());
}

TEST(ListHistory, ValuesOutOfNowhereAreFound) {
  EXPECT_EQ(anomalies({at_once({}, {{1, {7}}})}), std::vector{Anomaly::unwritten_value});
}

TEST(ListHistory, ValuesThatStandTwiceAreFound) {
  EXPECT_EQ(anomalies({at_once({{1, 7}}), at_once({}, {{1, {7, 7}}})}), std::vector{Anomaly::value_twice});
}

TEST(ListHistory, ReadsOfWhatCameToNothingAreFound) {
  Recorded missed = at_once({{1, 7}});
  missed.ending = Ending::nothing_done;
  EXPECT_EQ(anomalies({missed, at_once({}, {{1, {7}}})}), std::vector{Anomaly::aborted_read});
  missed.ending = Ending::unknown;
  EXPECT_TRUE(anomalies({missed, at_once({}, {{1, {7}}})}).empty());
}

TEST(ListHistory, HalvesAreFound) {
  EXPECT_EQ(anomalies({at_once({{1, 7}, {1, 8}}), at_once({}, {{1, {7}}})}), std::vector{Anomaly::half_read});
}

TEST(ListHistory, OwnAppendsMustBeSeen) {
  EXPECT_EQ(anomalies({at_once({{1, 7}}, {{1, {}}})}), std::vector{Anomaly::own_appends_misplaced});
}

TEST(ListHistory, ReadsThatComeFirstDoNotSeeOwnAppends) {
  Recorded one = at_once({{1, 7}}, {{1, {}}});
  one.reads_come_first = true;
  EXPECT_TRUE(anomalies({one, at_once({}, {{1, {7}}})}).empty());
  one.reads[0].values = {7};
  EXPECT_EQ(anomalies({one}), std::vector{Anomaly::own_appends_misplaced});
}

/// Two read the same list, and both appended to it by what they had read.
TEST(ListHistory, LostUpdatesAreFound) {
  Recorded first = at_once({{1, 7}}, {{1, {}}});
  Recorded second = at_once({{1, 8}}, {{1, {}}});
  first.reads_come_first = second.reads_come_first = true;
  EXPECT_EQ(anomalies({first, second, at_once({}, {{1, {7, 8}}})}),
            std::vector{Anomaly::single_antidependency_cycle});
}

TEST(ListHistory, ReadsThatDisagreeAreFound) {
  const std::vector<Recorded> history{at_once({{1, 7}}), at_once({{1, 8}}), at_once({}, {{1, {7, 8}}}),
                                      at_once({}, {{1, {8, 7}}})};
  EXPECT_EQ(anomalies(history), std::vector{Anomaly::lists_disagree});
}

TEST(ListHistory, LostAppendsAreFound) {
  const std::vector<Recorded> history{at_once({{1, 7}}), at_once({{1, 8}}),
                                      lasting(200, 201, {}, {{1, {8}}})};
  EXPECT_EQ(anomalies(history, true), std::vector{Anomaly::append_lost});
}

TEST(ListHistory, CyclesOfWritesAreFound) {
  const std::vector<Recorded> history{at_once({{1, 10}, {2, 20}}), at_once({{1, 11}, {2, 21}}),
                                      at_once({}, {{1, {10, 11}}}), at_once({}, {{2, {21, 20}}})};
  EXPECT_EQ(anomalies(history), std::vector{Anomaly::write_cycle});
}

TEST(ListHistory, CyclesOfReadsAndWritesAreFound) {
  const std::vector<Recorded> history{at_once({{1, 10}}, {{2, {20}}}), at_once({{2, 20}}, {{1, {10}}})};
  EXPECT_EQ(anomalies(history), std::vector{Anomaly::information_cycle});
}

/// One saw the first of two lists before, and the second after, another wrote both.
TEST(ListHistory, ReadSkewIsFound) {
  const std::vector<Recorded> history{at_once({{1, 10}, {2, 20}}), at_once({}, {{1, {}}, {2, {20}}}),
                                      at_once({}, {{1, {10}}})};
  EXPECT_EQ(anomalies(history), std::vector{Anomaly::single_antidependency_cycle});
}

/// Each read what the other wrote behind, before it did.
TEST(ListHistory, WriteSkewIsFound) {
  const std::vector<Recorded> history{at_once({{1, 10}}, {{2, {}}}), at_once({{2, 20}}, {{1, {}}}),
                                      at_once({}, {{1, {10}}, {2, {20}}})};
  EXPECT_EQ(anomalies(history), std::vector{Anomaly::antidependency_cycle});
}

/// Serial in another order than they happened: the second began after the first had ended and did not see it.
TEST(ListHistory, StaleReadsAreFoundUnlessThePastWasAskedFor) {
  std::vector<Recorded> history{lasting(0, 1, {{1, 10}}), lasting(2, 3, {}, {{1, {}}}),
                                lasting(4, 5, {}, {{1, {10}}})};
  EXPECT_EQ(anomalies(history), std::vector{Anomaly::against_real_time});
  history[1].reads_the_past = true;
  EXPECT_TRUE(anomalies(history).empty());
}

/// A serial execution by a model, whose transactions overlap in time.
std::vector<Recorded> serial_history(std::uint32_t seed, std::size_t transactions) {
  std::mt19937 random(seed);
  std::vector<std::vector<Value>> lists(8);
  std::vector<Recorded> history;
  Value next_value = 1;
  for (std::size_t k = 0; k < transactions; ++k) {
    const auto instant = static_cast<std::int64_t>(10 * k);
    Recorded one = lasting(instant - static_cast<std::int64_t>(random() % 50),
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
  Recorded last = lasting(static_cast<std::int64_t>(10 * transactions + 100),
                          static_cast<std::int64_t>(10 * transactions + 101), {});
  for (Key key = 0; key < 8; ++key)
    last.reads.push_back({key, lists[key]});
  history.push_back(std::move(last));
  return history;
}

TEST(ListHistory, SerialExecutionsPassInAnyOrderOfTheirRecords) {
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    std::vector<Recorded> history = serial_history(seed, 300);
    std::ranges::shuffle(history, std::mt19937(seed));
    const auto found = find_anomalies(history);
    ASSERT_TRUE(found.empty()) << "seed " << seed << ": " << to_string(found[0].anomaly) << ", "
                               << found[0].what;
  }
}

/// One read of a serial execution loses or gains its last value: nearly always another answer than any order
/// has.
TEST(ListHistory, OneWrongReadAmongHundredsIsFound) {
  std::size_t found = 0;
  std::size_t tried = 0;
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    std::vector<Recorded> history = serial_history(seed, 300);
    std::mt19937 random(seed + 1000);
    Recorded& one = history[100 + random() % 100];
    if (one.reads.empty() || !one.appends.empty() || one.reads[0].values.size() < 12) continue;
    one.reads[0].values.resize(one.reads[0].values.size() - 10);  // ten appends ago: long before it began
    ++tried;
    found += find_anomalies(history).empty() ? 0 : 1;
  }
  EXPECT_GT(tried, 20u);
  EXPECT_EQ(found, tried);
}

}  // namespace
}  // namespace hil::stress
