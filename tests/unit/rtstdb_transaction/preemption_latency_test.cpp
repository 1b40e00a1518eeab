#include "rtstdb/scheduler/preemption_latency.hpp"

#include <gtest/gtest.h>

namespace rtstdb::scheduler::test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds usual{500'000}, long_one{25'000'000};
constexpr ClockTime first_came{Nanoseconds(1'000'000'000'000)};

PreemptionLatency after_usual_ones() {
  PreemptionLatency waits;
  for (int i = 0; i < 100; ++i)
    waits.learn(usual, first_came - 10ms * (100 - i));
  return waits;
}

TEST(PreemptionLatencyTest, AreNoneBeforeAnybodyWaited) {
  EXPECT_EQ(PreemptionLatency().longest(first_came), 0ns);
}

TEST(PreemptionLatencyTest, AreAsLongAsTheyAllAre) {
  const Nanoseconds longest = after_usual_ones().longest(first_came);
  EXPECT_LE(longest, usual);
  EXPECT_GT(longest, usual * 9 / 10);
}

TEST(PreemptionLatencyTest, OneThatIsLongByItselfMovesThemByHalf) {
  PreemptionLatency waits = after_usual_ones();
  waits.learn(100 * long_one, first_came);
  EXPECT_GT(waits.longest(first_came), usual);
  EXPECT_LE(waits.longest(first_came), usual * 3 / 2);
}

/// Among a hundred a second.
TEST(PreemptionLatencyTest, FollowThoseThatComeFiveTimesASecond) {
  PreemptionLatency waits = after_usual_ones();
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

TEST(PreemptionLatencyTest, LeaveOutThoseThatAreRare) {
  PreemptionLatency waits = after_usual_ones();
  ClockTime now = first_came;
  for (int i = 0; i < 2'000; ++i) {
    now += 10ms;
    waits.learn(i % 200 == 0 ? long_one : usual, now);
    ASSERT_LT(waits.longest(now), 2 * usual);
  }
}

TEST(PreemptionLatencyTest, AreForgottenByHalfEverySecond) {
  PreemptionLatency waits;
  for (int i = 0; i < 20; ++i)
    waits.learn(long_one, first_came);
  ASSERT_EQ(waits.longest(first_came), long_one);
  EXPECT_EQ(waits.longest(first_came + 1s), long_one / 2);
  EXPECT_LT(waits.longest(first_came + 10s), usual);
}

}  // namespace
}  // namespace rtstdb::scheduler::test
