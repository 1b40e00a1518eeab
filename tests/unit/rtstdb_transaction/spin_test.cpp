// Polling before a sleep: bounded, rare where it fails, and off where it could starve other threads.

#include "rtstdb/transaction/spin.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <thread>

#include "tests/support/eventually.hpp"
#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

TEST(Spin, PollsUntilTheConditionHolds) {
  Spin spin;
  int polls = 0;
  EXPECT_TRUE(spin.until(10s, [&] { return ++polls == 1000; }));
  EXPECT_EQ(polls, 1000);
  EXPECT_FALSE(spin.until(0ns, [] { return false; }));
  EXPECT_TRUE(spin.until(0ns, [] { return true; })) << "it always polls once";
}

TEST(Spin, IsRareAfterFailures) {
  Spin spin;
  int spun = 0;
  for (int k = 0; k < 1000; ++k) {
    int polls = 0;
    spin.until(100us, [&] {
      ++polls;
      return false;
    });
    spun += polls > 1;
  }
  EXPECT_GE(spun, 10) << "it tries again in some of the rounds";
  EXPECT_LE(spun, 40);
  for (int k = 0; k < 200; ++k)
    spin.until(10s, [] { return true; });
  int polls = 0;
  EXPECT_TRUE(spin.until(10s, [&] { return ++polls == 100; })) << "it spins again after successes";
}

TEST(Spin, IsOffOnOneProcessor) {
  // In a thread, so that the affinity ends with it.
  std::thread([] {
    cpu_set_t before;
    ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
    EXPECT_EQ(spin_where_possible(5us), CPU_COUNT(&before) < 2 ? 0us : 5us);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(sched_getcpu(), &one);
    ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
    EXPECT_EQ(spin_where_possible(5us), 0us);
  }).join();
}

TEST(Spin, RealTimeThreadsPollOnce) {
  std::thread([] {
    Spin spin;
    const auto polls = [&] {
      int count = 0;
      spin.until(5ms, [&] {
        ++count;
        return false;
      });
      return count;
    };
    EXPECT_GT(polls(), 1);
    const sched_param parameters{.sched_priority = 1};
    const bool permitted = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
    // A Spin acts by a new policy within 10 ms.
    if (permitted) {
      EXPECT_TRUE(hil::tests::eventually([&] { return polls() == 1; }));
    }
    const sched_param ordinary{};
    ASSERT_EQ(pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary), 0);
    EXPECT_TRUE(hil::tests::eventually([&] { return polls() > 1; }));
  }).join();
}

TEST(Spin, LosesNoWakeUpBeforeTheSleep) {
  EngineOptions options = engine_options();
  options.spin = 20us;
  World world(options);
  const EntityId entity = world.create(0);
  std::vector<std::thread> threads;
  for (unsigned k = 0; k < 3; ++k) {
    threads.emplace_back([&, k] {
      const auto transaction = world.make();
      for (unsigned round = 0; round < 2000; ++round) {
        transaction->begin({});
        transaction->update(entity, row_of(round));
        EXPECT_EQ(world.execute(*transaction).status, Status::committed);
        // The engine thread spins and sleeps in turn: pauses are shorter or longer than the spin.
        if (round % 64 == 0) std::this_thread::sleep_for(Nanoseconds(10'000 * (k + 1)));
      }
    });
  }
  for (std::thread& thread : threads)
    thread.join();
  EXPECT_EQ(world.engine.counts().committed, 3u * 2000u + 1u);
}

}  // namespace
}  // namespace rtstdb::transaction::test
