// A stop request ends a run after the current tick, and no thread remains.

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <iterator>
#include <thread>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::FakeRun;
using test::ScriptedTask;
using test::spec_of;

std::atomic<bool> interrupted{false};

std::ptrdiff_t threads_of_this_process() {
  namespace fs = std::filesystem;
  return std::distance(fs::directory_iterator("/proc/self/task"), fs::directory_iterator());
}

TEST(Stop, EndsARunAfterTheCurrentTick) {
  FakeRun fake(0);
  std::uint64_t last = 0;
  int ends = 0;
  ScriptedTask task([&](const TickInfo& tick) {
    last = tick.tick;
    if (tick.tick == 7) fake.stop = true;
  });
  fake.hooks.on_end = [&](const TickInfo&) { ++ends; };
  const RunResult result = fake.run({{spec_of("t"), &task}});
  EXPECT_TRUE(result.stopped);
  EXPECT_EQ(last, 7U);
  EXPECT_EQ(ends, 8) << "the current tick is completed";
  EXPECT_EQ(result.ticks, 8U);
}

TEST(Stop, BeforeTheRunRunsNoTick) {
  FakeRun fake(100);
  fake.stop = true;
  ScriptedTask task;
  const RunResult result = fake.run({{spec_of("t"), &task}});
  EXPECT_TRUE(result.stopped);
  EXPECT_EQ(result.ticks, 0U);
  EXPECT_EQ(result.tasks[0].runs, 0U);
  EXPECT_EQ(result.tasks[0].slack_min_ns, 0);
}

TEST(Stop, BySignalEndsALongSleepAndJoinsAllThreads) {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = true; };
  struct sigaction before {};
  sigaction(SIGINT, &action, &before);
  std::thread([] {}).join();  // the thread sanitizer starts a thread with the first one
  const auto threads_before = threads_of_this_process();
  MonotonicClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  options.base_period_ns = 1'000'000'000;
  std::atomic<bool> step_begun{false}, step_done{false};
  ScriptedTask threaded([&, base_thread = gettid()](const TickInfo&) {
    step_begun = true;
    while (!interrupted)
      std::this_thread::yield();
    test::wait_until_thread_sleeps(base_thread);  // it waits for this step
    step_done = true;
  });
  Executive executive(options);
  executive.add_task(spec_of("threaded", 1, "threaded"), threaded);
  const pthread_t base = pthread_self();
  std::thread sender([&] {
    while (executive.live().ticks_begun == 0 || !step_begun)
      std::this_thread::yield();
    pthread_kill(base, SIGINT);
  });
  const RunResult result = executive.run(interrupted);
  sender.join();
  sigaction(SIGINT, &before, nullptr);
  EXPECT_TRUE(result.stopped);
  EXPECT_EQ(result.ticks, 1U) << "it does not wait for the next tick";
  EXPECT_TRUE(step_done) << "the run waits for the current step";
  EXPECT_EQ(threads_of_this_process(), threads_before);
  EXPECT_EQ(result.tasks[0].runs, 1U);
}

}  // namespace
}  // namespace hil::executive
