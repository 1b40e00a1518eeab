// A stop request ends a run in order within one tick and leaves no thread behind.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <iterator>
#include <thread>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using testing::FakeRun;
using testing::ScriptedTask;
using testing::spec_of;

std::atomic<bool> interrupted{false};

std::ptrdiff_t threads_of_this_process() {
  namespace fs = std::filesystem;
  return std::distance(fs::directory_iterator("/proc/self/task"), fs::directory_iterator());
}

TEST(Stop, EndsAfterTheTickOfTheRequest) {
  FakeRun fake(0);
  std::uint64_t last = 0;
  int ends = 0;
  ScriptedTask task([&](const TickInfo& tick) {
    last = tick.tick;
    if (tick.tick == 7) fake.stop = true;
  });
  fake.hooks.on_end = [&](const TickInfo&) { ++ends; };
  Executive executive(fake.options);
  executive.add_task(spec_of("t"), task);
  const RunResult result = executive.run(fake.stop);
  EXPECT_TRUE(result.stopped);
  EXPECT_EQ(last, 7U);
  EXPECT_EQ(ends, 8) << "the tick under way is finished";
  EXPECT_EQ(result.ticks, 8U);
}

TEST(Stop, ARequestBeforeTheRunRunsNothing) {
  FakeRun fake(100);
  fake.stop = true;
  ScriptedTask task;
  Executive executive(fake.options);
  executive.add_task(spec_of("t"), task);
  const RunResult result = executive.run(fake.stop);
  EXPECT_TRUE(result.stopped);
  EXPECT_EQ(result.ticks, 0U);
  EXPECT_EQ(result.tasks[0].runs, 0U);
  EXPECT_EQ(result.tasks[0].slack_min_ns, 0);
}

TEST(Stop, ASignalEndsTheSleepOfALongTickAndAllThreadsAreJoined) {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = true; };
  struct sigaction before {};
  sigaction(SIGINT, &action, &before);
  std::thread([] {}).join();  // with the first thread the thread sanitizer starts one that stays
  const auto threads_before = threads_of_this_process();
  MonotonicClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  options.base_period_ns = 1'000'000'000;
  std::atomic<bool> step_begun{false}, step_done{false};
  ScriptedTask own([&](const TickInfo&) {
    step_begun = true;
    while (!interrupted)
      std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // longer than the end takes without it
    step_done = true;
  });
  Executive executive(options);
  executive.add_task(spec_of("own", 1, "own"), own);
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
  EXPECT_EQ(result.ticks, 1U) << "not another second of waiting";
  EXPECT_TRUE(step_done) << "a step under way is waited for";
  EXPECT_EQ(threads_of_this_process(), threads_before);
  EXPECT_EQ(result.tasks[0].runs, 1U);
}

}  // namespace
}  // namespace hil::executive
