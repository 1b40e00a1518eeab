#include "runtime/modules/event_log.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "tests/support/allocation_guard.hpp"

namespace hil::modules {
namespace {

TEST(EventLog, PutsTheNumberIntoTheText) {
  EventLog log;
  const auto braking = log.add_kind("asks for {} m/s2");
  const auto stands = log.add_kind("stands, x = {} m", 2);
  const auto bodies = log.add_kind("touches {} bodies", 0);
  const auto plain = log.add_kind("light turns green");
  log.note(braking, 10, 8.25);
  log.note(stands, 20, -7.126);
  log.note(bodies, 30, 2.0);
  log.note(plain, 40, 99.0);
  const auto events = log.events();
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0].text, "asks for 8.2 m/s2");
  EXPECT_EQ(events[1].text, "stands, x = -7.13 m");
  EXPECT_EQ(events[2].text, "touches 2 bodies");
  EXPECT_EQ(events[3].text, "light turns green");
  EXPECT_EQ(events[1].time_ns, 20);
  EXPECT_EQ(log.lost(), 0U);
}

TEST(EventLog, IsEmptyWhenNothingHappened) {
  EventLog log;
  log.add_kind("never noted");
  EXPECT_TRUE(log.events().empty());
}

TEST(EventLog, OrdersByTimeAndThenByKindWhateverTheOrderOfNoting) {
  EventLog log;
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

TEST(EventLog, KeepsTheFirstOnesAndCountsTheRest) {
  EventLog log(3);
  const auto kind = log.add_kind("event {}", 0);
  for (int i = 0; i < 10; ++i)
    log.note(kind, i, i);
  const auto events = log.events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[2].text, "event 2");
  EXPECT_EQ(log.lost(), 7U);
}

TEST(EventLog, TakesEventsFromManyThreadsAtOnceAndLosesNone) {
  constexpr int threads = 4;
  constexpr int each = 5'000;
  EventLog log(threads * each);
  std::vector<EventLog::Kind> kinds;
  kinds.reserve(threads);
  for (int i = 0; i < threads; ++i)
    kinds.push_back(log.add_kind(std::string("thread ").append(std::to_string(i)) + " event {}", 0));
  std::vector<std::thread> running;
  running.reserve(threads);
  for (int i = 0; i < threads; ++i) {
    running.emplace_back([&, i] {
      for (int k = 0; k < each; ++k)
        log.note(kinds[static_cast<std::size_t>(i)], k, k);
    });
  }
  for (std::thread& thread : running)
    thread.join();
  EXPECT_EQ(log.lost(), 0U);
  const auto events = log.events();
  ASSERT_EQ(events.size(), static_cast<std::size_t>(threads * each));
  for (int k = 0; k < each; ++k) {
    for (int i = 0; i < threads; ++i) {
      const auto& event = events[static_cast<std::size_t>(k) * threads + static_cast<std::size_t>(i)];
      ASSERT_EQ(event.time_ns, k);
      ASSERT_EQ(event.text, std::string("thread ").append(std::to_string(i)) + " event " + std::to_string(k));
    }
  }
}

TEST(EventLog, ManyThreadsBeyondTheCapacityAreCountedExactly) {
  EventLog log(100);
  const auto kind = log.add_kind("x");
  std::vector<std::thread> running;
  running.reserve(4);
  for (int i = 0; i < 4; ++i) {
    running.emplace_back([&] {
      for (int k = 0; k < 1'000; ++k)
        log.note(kind, k);
    });
  }
  for (std::thread& thread : running)
    thread.join();
  EXPECT_EQ(log.events().size(), 100U);
  EXPECT_EQ(log.lost(), 3'900U);
}

TEST(EventLog, NotingDoesNotAllocate) {
  EventLog log(10);
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
