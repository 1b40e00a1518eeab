// The two ways values cross between a device's thread and the tick: LatestValue and TimedRowRing.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "io/can/filter.hpp"
#include "io/can/latest_value.hpp"
#include "io/can/timed_row_ring.hpp"

namespace hil::io::can {
namespace {

TEST(LatestValue, ReaderSeesTheNewestAndKeepsItUntilItAsksAgain) {
  LatestValue<int> value(0);
  EXPECT_EQ(value.newest(), 0);
  value.draft() = 1;
  EXPECT_EQ(value.newest(), 0) << "not published yet";
  value.publish();
  value.draft() = 2;
  value.publish();
  const int& seen = value.newest();
  EXPECT_EQ(seen, 2);
  value.draft() = 3;
  value.publish();
  EXPECT_EQ(seen, 2);
  EXPECT_EQ(value.newest(), 3);
  EXPECT_EQ(value.newest(), 3);
}

TEST(LatestValue, NeverTornAndNeverGoesBack) {
  using Many = std::vector<std::uint64_t>;
  LatestValue<Many> value(Many(64, 0));
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (std::uint64_t count = 1; count <= 200'000; ++count) {
      for (std::uint64_t& element : value.draft())
        element = count;
      value.publish();
    }
    done = true;
  });
  std::uint64_t last = 0;
  std::uint64_t changes = 0;
  bool finished = false;
  while (!finished) {
    finished = done.load();
    const Many& seen = value.newest();
    for (const std::uint64_t element : seen)
      ASSERT_EQ(element, seen.front());
    ASSERT_GE(seen.front(), last);
    changes += seen.front() != last ? 1 : 0;
    last = seen.front();
  }
  writer.join();
  EXPECT_EQ(last, 200'000U);
  EXPECT_GT(changes, 0U);
}

TEST(TimedRowRing, RefusesWhenFullAndGivesBackInOrder) {
  TimedRowRing ring(3, 2);
  for (int row = 0; row < 3; ++row)
    EXPECT_TRUE(ring.push(std::array<double, 2>{1.0 * row, 2.0 * row}, row));
  EXPECT_FALSE(ring.push(std::array<double, 2>{9.0, 9.0}, 9));
  for (int row = 0; row < 3; ++row) {
    EXPECT_TRUE(ring.take([&](std::span<const double> values, RunTimeNs tick_ns) {
      EXPECT_EQ(tick_ns, row);
      EXPECT_EQ(values[1], 2.0 * row);
    }));
  }
  EXPECT_FALSE(ring.take([](auto, auto) { FAIL(); }));
}

TEST(TimedRowRing, EveryRowThatWasTakenInComesOutOnceAndInOrder) {
  TimedRowRing ring(16, 3);
  constexpr int rows = 100'000;
  std::thread producer([&] {
    for (int row = 0; row < rows; ++row) {
      const double value = row;
      while (!ring.push(std::array<double, 3>{value, value, value}, row))
        std::this_thread::yield();
    }
  });
  int next = 0;
  while (next < rows) {
    const bool took = ring.take([&](std::span<const double> values, RunTimeNs tick_ns) {
      ASSERT_EQ(tick_ns, next);
      ASSERT_EQ(values[0], next);
      ASSERT_EQ(values[2], next);
    });
    if (took) {
      ++next;
    } else {
      std::this_thread::yield();
    }
  }
  producer.join();
}

TEST(TimedRowRing, ADeviceWithoutOutputsStillPassesTicks) {
  TimedRowRing ring(2, 0);
  EXPECT_TRUE(ring.push({}, 7));
  EXPECT_TRUE(ring.take([](std::span<const double> values, RunTimeNs tick_ns) {
    EXPECT_TRUE(values.empty());
    EXPECT_EQ(tick_ns, 7);
  }));
}

TEST(FilterSet, FollowsTheKernelsRule) {
  FilterSet filters;
  EXPECT_TRUE(filters.passes(0x123));
  const can_filter list[] = {{0x120, 0x7F0}, {0x300 | CAN_INV_FILTER, 0x700}};
  filters.assign(std::span(list, 1));
  EXPECT_TRUE(filters.passes(0x12F));
  EXPECT_FALSE(filters.passes(0x130));
  filters.assign(list);
  EXPECT_TRUE(filters.passes(0x130)) << "not 0x3xx";
  EXPECT_FALSE(filters.passes(0x3F0));
}

}  // namespace
}  // namespace hil::io::can
