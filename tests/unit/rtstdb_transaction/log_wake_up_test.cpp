// A notification wakes the sleeper: while it sleeps, before it sleeps and while it wakes up.

#include "rtstdb/transaction/log_wake_up.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <vector>

namespace rtstdb::transaction {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::uint32_t rounds = 2'000;
#else
constexpr std::uint32_t rounds = 50'000;
#endif

TEST(LogWakeUp, WakesAtEveryNotification) {
  LogWakeUp wake_up;
  std::atomic<std::uint32_t> put{0}, taken{0};
  std::thread sleeper([&] {
    while (taken.load() < rounds) {
      const LogWakeUp::Counts seen = wake_up.counts();
      if (put.load() != taken.load()) {
        taken.store(put.load());
        continue;
      }
      // Both ways in turn, as the log's thread does. The timeout is longer than that of the test.
      if (taken.load() % 3 != 0) {
        wake_up.sleep(seen);
      } else {
        wake_up.sleep_until_notified_now(seen, std::chrono::minutes(10));
      }
    }
  });
  for (std::uint32_t k = 1; k <= rounds; ++k) {
    const bool sleeps_until_now = taken.load() % 3 == 0;
    put.store(k);
    if (sleeps_until_now) {
      wake_up.notify_now();
    } else {
      wake_up.notify();
    }
    while (taken.load() != k) {
    }
  }
  sleeper.join();
  EXPECT_EQ(taken.load(), rounds);
}

TEST(LogWakeUp, WakesAtEveryNotificationOfSeveralThreads) {
  LogWakeUp wake_up;
  constexpr std::uint32_t threads = 4;
  std::atomic<std::uint32_t> put{0}, taken{0};
  std::thread sleeper([&] {
    while (taken.load() < threads * rounds) {
      const LogWakeUp::Counts seen = wake_up.counts();
      if (put.load() == taken.load()) {
        wake_up.sleep(seen);
      } else {
        taken.store(put.load());
      }
    }
  });
  std::vector<std::thread> notifiers;
  for (std::uint32_t t = 0; t < threads; ++t)
    notifiers.emplace_back([&] {
      for (std::uint32_t k = 0; k < rounds; ++k) {
        put.fetch_add(1);
        wake_up.notify();
        // So that the sleeper sleeps after each 16th.
        if (k % 16 == 0) {
          for (const std::uint32_t seen = put.load(); static_cast<std::int32_t>(taken.load() - seen) < 0;)
            std::this_thread::yield();
        }
      }
    });
  for (std::thread& thread : notifiers)
    thread.join();
  sleeper.join();
  EXPECT_EQ(taken.load(), threads * rounds);
}

TEST(LogWakeUp, SleepUntilNotifiedNowIgnoresOtherNotifications) {
  LogWakeUp wake_up;
  const auto begun = std::chrono::steady_clock::now();
  const LogWakeUp::Counts seen = wake_up.counts();
  wake_up.notify();
  wake_up.sleep_until_notified_now(seen, std::chrono::milliseconds(20));
  EXPECT_GE(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(19));
}

}  // namespace
}  // namespace rtstdb::transaction
