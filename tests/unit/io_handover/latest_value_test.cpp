#include "io/handover/latest_value.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <thread>

namespace hil::io {
namespace {

TEST(LatestValue, TakesTheNewestAndReportsReplacedValues) {
  LatestValue<int> exchange(7);
  EXPECT_EQ(exchange.current(), 7);
  EXPECT_FALSE(exchange.take_newest());
  exchange.draft() = 1;
  EXPECT_FALSE(exchange.publish());
  exchange.draft() = 2;
  EXPECT_TRUE(exchange.publish());  // 1 was never taken
  EXPECT_EQ(exchange.current(), 7);
  EXPECT_TRUE(exchange.take_newest());
  EXPECT_EQ(exchange.current(), 2);
  EXPECT_FALSE(exchange.take_newest());
  exchange.reset(9);
  EXPECT_FALSE(exchange.take_newest());
  EXPECT_EQ(exchange.current(), 9);
}

TEST(LatestValue, StatesAreCompleteAndInOrder) {
  using State = std::array<std::uint64_t, 16>;
  constexpr std::uint64_t rounds = 300'000;
  LatestValue<State> exchange(State{});
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= rounds; ++i) {
      exchange.draft().fill(i);
      exchange.publish();
    }
  });
  std::uint64_t last = 0;
  std::uint64_t taken = 0;
  while (last < rounds) {
    if (!exchange.take_newest()) continue;
    ++taken;
    const State& state = exchange.current();
    ASSERT_GT(state[0], last);
    last = state[0];
    for (const std::uint64_t word : state)
      ASSERT_EQ(word, last);
  }
  writer.join();
  EXPECT_GT(taken, 0U);
}

}  // namespace
}  // namespace hil::io
