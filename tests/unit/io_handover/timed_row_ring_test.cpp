#include "io/handover/timed_row_ring.hpp"

#include <gtest/gtest.h>

#include <array>
#include <span>
#include <thread>

#include "tests/support/rounds.hpp"

namespace hil::io {
namespace {

TEST(TimedRowRing, RefusesRowsWhenFullAndKeepsTheirOrder) {
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

TEST(TimedRowRing, DeliversEveryRowOnceInOrder) {
  TimedRowRing ring(16, 3);
  const int rows = static_cast<int>(tests::rounds(100'000));
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

TEST(TimedRowRing, RowsWithoutValuesCarryTheirTick) {
  TimedRowRing ring(2, 0);
  EXPECT_TRUE(ring.push({}, 7));
  EXPECT_TRUE(ring.take([](std::span<const double> values, RunTimeNs tick_ns) {
    EXPECT_TRUE(values.empty());
    EXPECT_EQ(tick_ns, 7);
  }));
}

}  // namespace
}  // namespace hil::io
