// A ring wakes the sleeper: while it sleeps, before it sleeps and while it wakes up.

#include "rtstdb/transaction/log_bell.hpp"

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

TEST(LogBell, WakesAtEveryRing) {
  LogBell bell;
  std::atomic<std::uint32_t> put{0}, taken{0};
  std::thread sleeper([&] {
    while (taken.load() < rounds) {
      const LogBell::Counts seen = bell.counts();
      if (put.load() != taken.load()) {
        taken.store(put.load());
        continue;
      }
      // Both ways in turn, as the log's thread does. The timeout is longer than that of the test.
      if (taken.load() % 3 != 0) {
        bell.sleep(seen);
      } else {
        bell.sleep_until_urgent(seen, std::chrono::minutes(10));
      }
    }
  });
  for (std::uint32_t k = 1; k <= rounds; ++k) {
    const bool urgent = taken.load() % 3 == 0;
    put.store(k);
    if (urgent) {
      bell.ring_urgently();
    } else {
      bell.ring();
    }
    while (taken.load() != k) {
    }
  }
  sleeper.join();
  EXPECT_EQ(taken.load(), rounds);
}

TEST(LogBell, WakesAtEveryRingOfSeveralThreads) {
  LogBell bell;
  constexpr std::uint32_t threads = 4;
  std::atomic<std::uint32_t> put{0}, taken{0};
  std::thread sleeper([&] {
    while (taken.load() < threads * rounds) {
      const LogBell::Counts seen = bell.counts();
      if (put.load() == taken.load()) {
        bell.sleep(seen);
      } else {
        taken.store(put.load());
      }
    }
  });
  std::vector<std::thread> ringing_threads;
  for (std::uint32_t t = 0; t < threads; ++t)
    ringing_threads.emplace_back([&] {
      for (std::uint32_t k = 0; k < rounds; ++k) {
        put.fetch_add(1);
        bell.ring();
        // So that the sleeper sleeps after each 16th.
        if (k % 16 == 0) {
          for (const std::uint32_t seen = put.load(); static_cast<std::int32_t>(taken.load() - seen) < 0;)
            std::this_thread::yield();
        }
      }
    });
  for (std::thread& thread : ringing_threads)
    thread.join();
  sleeper.join();
  EXPECT_EQ(taken.load(), threads * rounds);
}

TEST(LogBell, SleepUntilUrgentIgnoresAPlainRing) {
  LogBell bell;
  const auto begun = std::chrono::steady_clock::now();
  const LogBell::Counts seen = bell.counts();
  bell.ring();
  bell.sleep_until_urgent(seen, std::chrono::milliseconds(20));
  EXPECT_GE(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(19));
}

}  // namespace
}  // namespace rtstdb::transaction
