#include "runtime/executive/spsc_ring.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>
#include <vector>

#include "tests/support/rounds.hpp"

namespace hil::executive {
namespace {

std::vector<int> drained(SpscRing<int>& ring) {
  std::vector<int> seen;
  ring.drain([&](int value) { seen.push_back(value); });
  return seen;
}

TEST(SpscRing, FullRingLosesRecordsAndCountsThem) {
  SpscRing<int> ring(4);
  for (int i = 0; i < 4; ++i)
    EXPECT_TRUE(ring.push(i));
  EXPECT_FALSE(ring.push(4));
  EXPECT_FALSE(ring.push(5));
  EXPECT_EQ(ring.lost(), 2U);
  EXPECT_EQ(drained(ring), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_TRUE(ring.push(6));
  EXPECT_EQ(drained(ring), std::vector<int>{6});
}

TEST(SpscRing, FrontIsTheOldestRecordUntilItIsRemoved) {
  SpscRing<int> ring(2);
  EXPECT_EQ(ring.front(), nullptr);
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(ring.push(i) && ring.push(i + 100));
    EXPECT_FALSE(ring.push(i + 200));
    ASSERT_NE(ring.front(), nullptr);
    EXPECT_EQ(*ring.front(), i);
    EXPECT_EQ(*ring.front(), i) << "stays";
    ring.pop();
    ASSERT_NE(ring.front(), nullptr);
    EXPECT_EQ(*ring.front(), i + 100);
    ring.pop();
    EXPECT_EQ(ring.front(), nullptr);
  }
}

TEST(SpscRing, DrainLeavesRecordsThatArriveDuringTheDrain) {
  SpscRing<int> ring(8);
  ring.push(1);
  ring.drain([&](int value) { ring.push(value + 1); });
  EXPECT_EQ(drained(ring), std::vector<int>{2});
}

TEST(SpscRing, EveryRecordReachesTheOtherThreadInOrder) {
  struct Pair {
    std::uint64_t value, twice;
  };
  const std::uint64_t count = tests::rounds(200'000);
  SpscRing<Pair> ring(64);
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < count;) {
      if (ring.push({i, 2 * i})) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t next = 0;
  bool torn = false;
  while (next < count) {
    ring.drain([&](const Pair& pair) { torn |= pair.value != next++ || pair.twice != 2 * pair.value; });
    std::this_thread::yield();
  }
  writer.join();
  EXPECT_FALSE(torn);
}

}  // namespace
}  // namespace hil::executive
