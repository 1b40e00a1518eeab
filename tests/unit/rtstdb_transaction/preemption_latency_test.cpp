#include "rtstdb/scheduler/preemption_latency.hpp"

#include <gtest/gtest.h>

namespace rtstdb::scheduler::test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds usual{500'000}, high{25'000'000};
constexpr ClockTime start{Nanoseconds(1'000'000'000'000)};

PreemptionLatency after_usual_samples() {
  PreemptionLatency latency;
  for (int i = 0; i < 100; ++i)
    latency.update(usual, start - 10ms * (100 - i));
  return latency;
}

TEST(PreemptionLatencyTest, IsZeroWithoutSamples) {
  EXPECT_EQ(PreemptionLatency().longest(start), 0ns);
}

TEST(PreemptionLatencyTest, IsThatOfEqualSamples) {
  const Nanoseconds longest = after_usual_samples().longest(start);
  EXPECT_LE(longest, usual);
  EXPECT_GT(longest, usual * 9 / 10);
}

TEST(PreemptionLatencyTest, GrowsByHalfAfterASingleHighSample) {
  PreemptionLatency latency = after_usual_samples();
  latency.update(100 * high, start);
  EXPECT_GT(latency.longest(start), usual);
  EXPECT_LE(latency.longest(start), usual * 3 / 2);
}

/// One of twenty samples is high, with a hundred samples a second.
TEST(PreemptionLatencyTest, FollowsHighSamplesFiveTimesASecond) {
  PreemptionLatency latency = after_usual_samples();
  ClockTime now = start;
  Nanoseconds lowest = high;
  for (int i = 0; i < 1'000; ++i) {
    now += 10ms;
    latency.update(i % 20 == 0 ? high : usual, now);
    if (i > 300) lowest = std::min(lowest, latency.longest(now));
  }
  EXPECT_GT(lowest, high * 8 / 10);
  EXPECT_LE(latency.longest(now), high);
}

TEST(PreemptionLatencyTest, IgnoresRareHighSamples) {
  PreemptionLatency latency = after_usual_samples();
  ClockTime now = start;
  for (int i = 0; i < 2'000; ++i) {
    now += 10ms;
    latency.update(i % 200 == 0 ? high : usual, now);
    ASSERT_LT(latency.longest(now), 2 * usual);
  }
}

TEST(PreemptionLatencyTest, DecaysByHalfEverySecond) {
  PreemptionLatency latency;
  for (int i = 0; i < 20; ++i)
    latency.update(high, start);
  ASSERT_EQ(latency.longest(start), high);
  EXPECT_EQ(latency.longest(start + 1s), high / 2);
  EXPECT_LT(latency.longest(start + 10s), usual);
}

}  // namespace
}  // namespace rtstdb::scheduler::test
