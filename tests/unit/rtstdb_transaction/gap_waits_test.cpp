#include "rtstdb/transaction/gap_waits.hpp"

#include <gtest/gtest.h>

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds usual{500'000}, long_one{25'000'000};
constexpr ClockTime begin{Nanoseconds(1'000'000'000'000)};

GapWaits after_usual_ones() {
  GapWaits waits;
  for (int i = 0; i < 100; ++i)
    waits.learn(usual, begin - 10ms * (100 - i));
  return waits;
}

TEST(GapWaitsTest, AreNoneBeforeAnybodyWaited) {
  EXPECT_EQ(GapWaits().longest(begin), 0ns);
}

TEST(GapWaitsTest, AreAsLongAsTheyAllAre) {
  const Nanoseconds longest = after_usual_ones().longest(begin);
  EXPECT_LE(longest, usual);
  EXPECT_GT(longest, usual * 9 / 10);
}

TEST(GapWaitsTest, OneThatIsLongByItselfMovesThemByHalf) {
  GapWaits waits = after_usual_ones();
  waits.learn(100 * long_one, begin);
  EXPECT_GT(waits.longest(begin), usual);
  EXPECT_LE(waits.longest(begin), usual * 3 / 2);
}

/// Among a hundred a second.
TEST(GapWaitsTest, FollowThoseThatComeFiveTimesASecond) {
  GapWaits waits = after_usual_ones();
  ClockTime now = begin;
  Nanoseconds least = long_one;
  for (int i = 0; i < 1'000; ++i) {
    now += 10ms;
    waits.learn(i % 20 == 0 ? long_one : usual, now);
    if (i > 300) least = std::min(least, waits.longest(now));
  }
  EXPECT_GT(least, long_one * 8 / 10);
  EXPECT_LE(waits.longest(now), long_one);
}

TEST(GapWaitsTest, LeaveOutThoseThatAreRare) {
  GapWaits waits = after_usual_ones();
  ClockTime now = begin;
  for (int i = 0; i < 2'000; ++i) {
    now += 10ms;
    waits.learn(i % 200 == 0 ? long_one : usual, now);
    ASSERT_LT(waits.longest(now), 2 * usual);
  }
}

TEST(GapWaitsTest, AreForgottenByHalfEverySecond) {
  GapWaits waits;
  for (int i = 0; i < 20; ++i)
    waits.learn(long_one, begin);
  ASSERT_EQ(waits.longest(begin), long_one);
  EXPECT_EQ(waits.longest(begin + 1s), long_one / 2);
  EXPECT_LT(waits.longest(begin + 10s), usual);
}

}  // namespace
}  // namespace rtstdb::transaction::test
