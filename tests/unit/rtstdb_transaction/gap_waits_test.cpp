#include "rtstdb/transaction/gap_waits.hpp"

#include <gtest/gtest.h>

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds usual{500'000}, long_one{25'000'000};
constexpr ClockTime first_came{Nanoseconds(1'000'000'000'000)};

GapWaits after_usual_ones() {
  GapWaits waits;
  for (int i = 0; i < 100; ++i)
    waits.learn(usual, first_came - 10ms * (100 - i));
  return waits;
}

TEST(GapWaitsTest, AreNoneBeforeAnybodyWaited) {
  EXPECT_EQ(GapWaits().longest(first_came), 0ns);
}

TEST(GapWaitsTest, AreAsLongAsTheyAllAre) {
  const Nanoseconds longest = after_usual_ones().longest(first_came);
  EXPECT_LE(longest, usual);
  EXPECT_GT(longest, usual * 9 / 10);
}

TEST(GapWaitsTest, OneThatIsLongByItselfMovesThemByHalf) {
  GapWaits waits = after_usual_ones();
  waits.learn(100 * long_one, first_came);
  EXPECT_GT(waits.longest(first_came), usual);
  EXPECT_LE(waits.longest(first_came), usual * 3 / 2);
}

/// Among a hundred a second.
TEST(GapWaitsTest, FollowThoseThatComeFiveTimesASecond) {
  GapWaits waits = after_usual_ones();
  ClockTime now = first_came;
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
  ClockTime now = first_came;
  for (int i = 0; i < 2'000; ++i) {
    now += 10ms;
    waits.learn(i % 200 == 0 ? long_one : usual, now);
    ASSERT_LT(waits.longest(now), 2 * usual);
  }
}

TEST(GapWaitsTest, AreForgottenByHalfEverySecond) {
  GapWaits waits;
  for (int i = 0; i < 20; ++i)
    waits.learn(long_one, first_came);
  ASSERT_EQ(waits.longest(first_came), long_one);
  EXPECT_EQ(waits.longest(first_came + 1s), long_one / 2);
  EXPECT_LT(waits.longest(first_came + 10s), usual);
}

}  // namespace
}  // namespace rtstdb::transaction::test
