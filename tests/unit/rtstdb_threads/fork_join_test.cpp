#include "rtstdb/threads/fork_join.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "tests/support/allocation_guard.hpp"

namespace rtstdb::threads {
namespace {

/// How often each block was executed, and by which thread.
struct Done {
  explicit Done(std::uint32_t count) : times(count, 0), by(count, 9) {}
  void mark(std::uint32_t block, std::uint32_t thread) {
    ++times[block];
    by[block] = thread;
  }
  std::vector<int> times;
  std::vector<std::uint32_t> by;
};

TEST(ForkJoin, ExecutesEachBlockOnce) {
  ForkJoin both(0);
  for (std::uint32_t round = 0; round < 3000; ++round) {
    const std::uint32_t count = round % 70;
    Done done(count);
    both.for_each_block(count, [&](std::uint32_t block, std::uint32_t thread) { done.mark(block, thread); });
    EXPECT_EQ(done.times, std::vector<int>(count, 1)) << "round " << round;
    for (const std::uint32_t thread : done.by)
      EXPECT_LT(thread, ForkJoin::thread_count);
  }
}

TEST(ForkJoin, UsesBothThreads) {
  ForkJoin both(0);
  // A thread that takes a block waits until the other has one too, so the loop ends only with both threads.
  std::array<std::atomic<bool>, ForkJoin::thread_count> entered{};
  both.for_each_block(2, [&](std::uint32_t, std::uint32_t thread) {
    entered[thread] = true;
    entered[thread].notify_all();
    entered[1 - thread].wait(false);
  });
  EXPECT_TRUE(entered[0]);
  EXPECT_TRUE(entered[1]);
}

TEST(ForkJoin, WaitsForBlocksOfTheHelper) {
  ForkJoin both(0);
  for (int round = 0; round < 20; ++round) {
    std::atomic<bool> helper_runs{false};
    bool helper_has_ended = false;
    both.for_each_block(2, [&](std::uint32_t, std::uint32_t thread) {
      if (thread == 0) return helper_runs.wait(false);
      helper_runs = true;
      helper_runs.notify_all();
      // A right ForkJoin passes without the sleep, which gives a wrong one time to return early.
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      helper_has_ended = true;
    });
    EXPECT_TRUE(helper_has_ended);
  }
}

TEST(ForkJoin, ExecutesASingleBlockOnTheCallingThread) {
  ForkJoin both(0);
  for (int round = 0; round < 1000; ++round) {
    std::thread::id by;
    both.for_each_block(1, [&](std::uint32_t, std::uint32_t) { by = std::this_thread::get_id(); });
    EXPECT_EQ(by, std::this_thread::get_id());
  }
}

TEST(ForkJoin, CanBeDestroyedAtAnyTime) {
  for (int round = 0; round < 300; ++round) {
    ForkJoin both(0);
    std::atomic<int> done{0};
    if (round % 2 == 0) both.for_each_block(8, [&](std::uint32_t, std::uint32_t) { ++done; });
    EXPECT_EQ(done, round % 2 == 0 ? 8 : 0);
  }
}

TEST(ForkJoin, DoesNotAllocate) {
  namespace guard = hil::allocation_guard;
  ForkJoin both(0);
  Done done(64);
  guard::reset();
  guard::enter_tick();
  for (int round = 0; round < 100; ++round)
    both.for_each_block(64, [&](std::uint32_t block, std::uint32_t thread) { done.mark(block, thread); });
  guard::leave_tick();
  EXPECT_EQ(guard::seen().total(), 0u);
}

}  // namespace
}  // namespace rtstdb::threads
