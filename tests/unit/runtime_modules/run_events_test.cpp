#include "runtime/modules/run_events.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "tests/support/allocation_guard.hpp"

namespace hil::modules {
namespace {

TEST(RunEvents, WritesTheNumberIntoTheText) {
  RunEvents log;
  const auto braking = log.add_kind("requests {} m/s2");
  const auto stops = log.add_kind("stops at x = {} m", 2);
  const auto bodies = log.add_kind("touches {} bodies", 0);
  const auto plain = log.add_kind("light turns green");
  log.note(braking, 10, 8.25);
  log.note(stops, 20, -7.126);
  log.note(bodies, 30, 2.0);
  log.note(plain, 40, 99.0);
  const auto events = log.events();
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0].text, "requests 8.2 m/s2");
  EXPECT_EQ(events[1].text, "stops at x = -7.13 m");
  EXPECT_EQ(events[2].text, "touches 2 bodies");
  EXPECT_EQ(events[3].text, "light turns green");
  EXPECT_EQ(events[1].time_ns, 20);
  EXPECT_EQ(log.lost(), 0U);
}

TEST(RunEvents, OrdersEventsByTimeAndThenByKind) {
  RunEvents log;
  const auto first = log.add_kind("first {}", 0);
  const auto second = log.add_kind("second {}", 0);
  log.note(second, 5, 1.0);
  log.note(first, 5, 2.0);
  log.note(first, 5, 1.0);
  log.note(second, 3);
  const auto events = log.events();
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0].text, "second 0");
  EXPECT_EQ(events[1].text, "first 1");
  EXPECT_EQ(events[2].text, "first 2");
  EXPECT_EQ(events[3].text, "second 1");
}

TEST(RunEvents, KeepsTheFirstEventsAndCountsTheOthers) {
  RunEvents log(3);
  const auto kind = log.add_kind("event {}", 0);
  for (int i = 0; i < 10; ++i)
    log.note(kind, i, i);
  const auto events = log.events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[2].text, "event 2");
  EXPECT_EQ(log.lost(), 7U);
}

/// All events of four threads fit, or one in four does.
TEST(RunEvents, CountsEventsOfManyThreadsExactly) {
  constexpr int threads = 4;
  constexpr int each = 5'000;
  for (const int capacity : {threads * each, each}) {
    SCOPED_TRACE(capacity);
    RunEvents log(static_cast<std::size_t>(capacity));
    std::vector<RunEvents::Kind> kinds;
    for (int i = 0; i < threads; ++i)
      kinds.push_back(log.add_kind("thread " + std::to_string(i) + " event {}", 0));
    std::vector<std::thread> running;
    for (int i = 0; i < threads; ++i) {
      running.emplace_back([&, i] {
        for (int k = 0; k < each; ++k)
          log.note(kinds[static_cast<std::size_t>(i)], k, k);
      });
    }
    for (std::thread& thread : running)
      thread.join();
    EXPECT_EQ(log.lost(), static_cast<std::uint64_t>(threads * each - capacity));
    const auto events = log.events();
    ASSERT_EQ(events.size(), static_cast<std::size_t>(capacity));
    for (std::size_t i = 0; log.lost() == 0 && i < events.size(); ++i) {
      ASSERT_EQ(events[i].time_ns, static_cast<std::int64_t>(i / threads));
      ASSERT_EQ(events[i].text,
                "thread " + std::to_string(i % threads) + " event " + std::to_string(i / threads));
    }
  }
}

TEST(RunEvents, AddsEventsWithoutAllocation) {
  RunEvents log(10);
  const auto kind = log.add_kind("a text that is too long for a small string, with a number {}");
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int i = 0; i < 20; ++i)
    log.note(kind, i, i);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::modules
