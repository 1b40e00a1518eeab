#include "io/handover/kept_arrivals.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>
#include <vector>

#include "io/handover/latest_value.hpp"

namespace hil::io {
namespace {

TEST(KeptArrivals, ATickTakesThoseThatItHasLatched) {
  KeptArrivals arrivals;
  std::vector<InputValue> values(3);
  EXPECT_FALSE(arrivals.take(values)) << "nothing is kept";
  arrivals.keep(1, 2, 2);
  for (int i = 0; i < 3; ++i) {
    arrivals.add(0, -1.0);  // not kept
    arrivals.add(1, i);
    arrivals.complete(10 * i);
  }
  EXPECT_FALSE(arrivals.take(values)) << "nothing is latched";
  arrivals.latch(2);
  for (int i = 0; i < 2; ++i) {
    const auto arrival = arrivals.take(values);
    ASSERT_TRUE(arrival);
    EXPECT_EQ(arrival->time_ns, 10 * i);
    ASSERT_EQ(arrival->count, 1U);
    EXPECT_EQ(values[0].value, i);
  }
  EXPECT_FALSE(arrivals.take(values));
  arrivals.latch_all();
  EXPECT_TRUE(arrivals.take(values));
  EXPECT_FALSE(arrivals.take(values));
}

TEST(KeptArrivals, LostOnesAreNotWaitedFor) {
  KeptArrivals arrivals;
  arrivals.keep(0, 1, 1);
  std::vector<InputValue> values(1);
  for (std::size_t i = 0; i < max_kept_arrivals + 5; ++i) {
    arrivals.add(0, 1.0);
    arrivals.complete(0);
  }
  EXPECT_EQ(arrivals.lost(), 5U);
  arrivals.latch_all();
  std::size_t taken = 0;
  while (arrivals.take(values))
    ++taken;
  EXPECT_EQ(taken, max_kept_arrivals);
}

/// Whatever the threads do, the last arrival that a tick takes has the value that the tick has latched.
TEST(KeptArrivals, TheLastOneOfATickHasItsValue) {
  constexpr int count = 20'000;
  KeptArrivals arrivals;
  arrivals.keep(0, 1, 1);
  LatestValue<ValuesOfArrivals<double>> newest({.values = 0.0});
  std::atomic<int> taken{0};
  std::thread device([&] {
    std::mt19937 random(7);
    for (int i = 1; i <= count; ++i) {
      while (i - taken.load() > 1000)
        std::this_thread::yield();
      arrivals.add(0, i);
      arrivals.complete(i);
      if (random() % 3 == 0 && i < count) continue;  // several arrivals are published at once
      newest.draft() = {.values = static_cast<double>(i), .arrivals = arrivals.completed()};
      newest.publish();
    }
  });
  std::vector<InputValue> values(1);
  double last = 0.0;
  while (taken.load() < count && !HasFailure()) {
    newest.take_newest();
    arrivals.latch(newest.current().arrivals);
    while (arrivals.take(values)) {
      EXPECT_EQ(values[0].value, last + 1.0);
      last = values[0].value;
      ++taken;
    }
    EXPECT_EQ(last, newest.current().values);
  }
  taken = count;  // the device waits for nothing
  device.join();
}

TEST(KeptArrivals, RepliesToSafeValuesAreNotKept) {
  KeptArrivals arrivals;
  arrivals.keep(0, 1, 1);
  const auto arrive = [&](double value) {
    arrivals.add(0, value);
    arrivals.complete(0);
  };
  arrive(1.0);
  arrivals.end();
  arrive(2.0);
  arrivals.latch_all();
  std::vector<InputValue> values(1);
  ASSERT_TRUE(arrivals.take(values));
  EXPECT_EQ(values[0].value, 1.0);
  EXPECT_FALSE(arrivals.take(values));
  EXPECT_EQ(arrivals.lost(), 0U);
  arrivals.begin();
  arrive(3.0);
  arrivals.latch_all();
  ASSERT_TRUE(arrivals.take(values));
  EXPECT_EQ(values[0].value, 3.0);
}

}  // namespace
}  // namespace hil::io
