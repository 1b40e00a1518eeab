// Tasks on threads of their own. Base time is fake and stands still while a tick runs, the other threads are
// real: each test says with a semaphore when a step may end, so that every interleaving is the one meant.

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <mutex>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using testing::FakeRun;
using testing::ScriptedTask;
using testing::spec_of;
using Ticks = std::vector<std::uint64_t>;
constexpr std::int64_t ms = 1'000'000;

/// Waits until a task's thread, whose step has ended, has told the executive so: it then sleeps. Three looks
/// in a row, since it may fall asleep for a moment on its way there.
void wait_until_it_sleeps(pid_t thread) {
  for (int asleep = 0; asleep < 3; ++asleep) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::ifstream stat("/proc/self/task/" + std::to_string(thread) + "/stat");
    const std::string text{std::istreambuf_iterator<char>(stat), {}};
    const std::size_t name_end = text.rfind(')');  // the state stands behind the name
    if (name_end == std::string::npos || text[name_end + 2] != 'S') asleep = -1;
  }
}

/// A task of 4 ticks period whose steps end only when the test says so, and a note of what was published
/// when.
struct HeldTask {
  explicit HeldTask(FakeRun& fake_run) : fake(fake_run) {
    task.on_latch = [this](const TickInfo& info) { latched.push_back(info.tick); };
    task.on_step = [this](const TickInfo& info) {
      thread = gettid();
      started.release();
      may_end.acquire();
      out = info.tick;
      ended.release();
    };
    task.on_publish = [this](const TickInfo& info) {
      EXPECT_EQ(info.tick, out) << "the outputs of this very run";
      published.push_back({info.tick, now_tick});
    };
    task.on_abort = [this] {
      ++aborts;
      may_end.release();
    };
    fake.hooks.on_begin = [this](const TickInfo& info) {
      now_tick = info.tick;
      if (at_tick) at_tick(info.tick);
    };
  }
  RunResult run(OverrunPolicy policy) {
    TaskSpec spec = spec_of("held", 4, "held");
    spec.overrun = policy;
    Executive executive(fake.options);
    executive.add_task(spec, task);
    return executive.run(fake.stop);
  }
  /// Lets the step under way end and waits until the executive can see it.
  void end_step() {
    may_end.release();
    ended.acquire();
    wait_until_it_sleeps(thread);
  }

  struct Published {
    std::uint64_t release, at;
    bool operator==(const Published&) const = default;
  };
  FakeRun& fake;
  ScriptedTask task;
  std::function<void(std::uint64_t)> at_tick;
  std::counting_semaphore<> started{0}, may_end{0}, ended{0};
  pid_t thread = 0;  // written before `started`
  std::uint64_t now_tick = 0, out = 0;
  int aborts = 0;
  Ticks latched;
  std::vector<Published> published;
};

TEST(OwnThread, PublishesAtTheDeadlineTickHoweverEarlyTheStepEnded) {
  FakeRun fake(13);
  HeldTask held(fake);
  held.at_tick = [&](std::uint64_t tick) {
    if (tick % 4 == 1) held.end_step();
  };
  held.may_end.release();  // for the run released in the last tick
  const RunResult result = held.run(OverrunPolicy::skip);
  EXPECT_EQ(held.latched, (Ticks{0, 4, 8, 12}));
  EXPECT_EQ(held.published, (std::vector<HeldTask::Published>{{0, 4}, {4, 8}, {8, 12}}));
  EXPECT_EQ(result.tasks[0].runs, 4U) << "the run under way at the end is finished, not published";
  EXPECT_EQ(result.tasks[0].deadline_misses, 0U);
}

TEST(OwnThread, SkipDropsReleasesWhileItRunsAndPublishesLate) {
  FakeRun fake(20);
  HeldTask held(fake);
  held.at_tick = [&](std::uint64_t tick) {
    if (tick == 10 || tick == 13 || tick == 17) held.end_step();
  };
  const RunResult result = held.run(OverrunPolicy::skip);
  EXPECT_EQ(held.latched, (Ticks{0, 12, 16}));
  EXPECT_EQ(held.published, (std::vector<HeldTask::Published>{{0, 10}, {12, 16}}));
  const TaskResult& task = result.tasks[0];
  EXPECT_EQ(task.runs, 3U);
  EXPECT_EQ(task.deadline_misses, 1U);
  EXPECT_EQ(task.overruns, 1U) << "one run that overran, however many releases it cost";
  EXPECT_EQ(task.skipped, 2U) << "releases 4 and 8";
  ASSERT_EQ(task.misses.size(), 1U);
  EXPECT_EQ(task.misses[0].tick, 0U);
  EXPECT_EQ(task.misses[0].lateness_ns, 6 * ms);
}

TEST(OwnThread, QueueKeepsOneReleaseAndRunsItAsSoonAsItIsFree) {
  FakeRun fake(20);
  HeldTask held(fake);
  held.at_tick = [&](std::uint64_t tick) {
    if (tick == 10 || tick == 11 || tick == 13 || tick == 17) held.end_step();
  };
  std::vector<std::pair<TickInfo, std::uint64_t>> kept;
  held.task.on_keep = [&](const TickInfo& info) { kept.emplace_back(info, held.now_tick); };
  const RunResult result = held.run(OverrunPolicy::queue);
  EXPECT_EQ(held.latched, (Ticks{0, 4, 12, 16})) << "release 4 was kept, 8 skipped";
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_EQ(kept[0].first.tick, 4U);
  EXPECT_EQ(kept[0].first.time_ns, 4 * ms);
  EXPECT_EQ(kept[0].first.run, 1U);
  EXPECT_EQ(kept[0].second, 4U) << "at its own tick, when the world is as its run has to see it";
  EXPECT_EQ(held.published, (std::vector<HeldTask::Published>{{0, 10}, {4, 11}, {12, 16}}));
  const TaskResult& task = result.tasks[0];
  EXPECT_EQ(task.runs, 4U);
  EXPECT_EQ(task.deadline_misses, 2U);
  EXPECT_EQ(task.overruns, 1U);
  EXPECT_EQ(task.skipped, 1U);
  ASSERT_EQ(task.misses.size(), 2U);
  EXPECT_EQ(task.misses[1].tick, 4U);
  EXPECT_EQ(task.misses[1].lateness_ns, 3 * ms);
  EXPECT_EQ(task.misses[1].cause, task.misses[0].cause) << "it was late because the run before was";
}

TEST(OwnThread, AbortStopsTheStepAndDropsItsOutputs) {
  FakeRun fake(20);
  HeldTask held(fake);
  held.at_tick = [&](std::uint64_t tick) {
    if (tick == 1) held.started.acquire();  // only a running step can be aborted
    if (tick == 5) {
      held.ended.acquire();  // ended by abort() in tick 4
      wait_until_it_sleeps(held.thread);
    }
    if (tick == 9 || tick == 13 || tick == 17) held.end_step();
  };
  const RunResult result = held.run(OverrunPolicy::abort);
  EXPECT_EQ(held.aborts, 1);
  EXPECT_EQ(held.latched, (Ticks{0, 8, 12, 16}));
  EXPECT_EQ(held.published, (std::vector<HeldTask::Published>{{8, 12}, {12, 16}})) << "never the aborted one";
  const TaskResult& task = result.tasks[0];
  EXPECT_EQ(task.aborted, 1U);
  EXPECT_EQ(task.deadline_misses, 1U);
  EXPECT_EQ(task.overruns, 1U);
  EXPECT_EQ(task.skipped, 1U);
}

TEST(OwnThread, TasksThatShareAThreadRunByPeriodAndNameEachOther) {
  FakeRun fake(20);
  fake.options.catch_up_ticks = 100;
  std::mutex mutex;
  std::vector<std::string> order;
  const auto note = [&](const char* name) {
    const std::lock_guard lock(mutex);
    order.emplace_back(name);
  };
  std::binary_semaphore slow_started{0}, slow_may_end{0}, slow_ended{0}, fast_ended{0};
  pid_t thread = 0;
  ScriptedTask slow([&](const TickInfo& tick) {
    note("slow");
    thread = gettid();
    slow_started.release();
    if (tick.tick == 0) slow_may_end.acquire();
    slow_ended.release();
  });
  ScriptedTask fast([&](const TickInfo&) {
    note("fast");
    fast_ended.release();
  });
  fake.hooks.on_end = [&](const TickInfo& tick) {
    if (tick.tick == 0) slow_started.acquire();
    if (tick.tick == 7) {  // fast was released at 1 with its deadline at 6, and waits for slow
      slow_may_end.release();
      slow_ended.acquire();
      fast_ended.acquire();
      wait_until_it_sleeps(thread);
    } else if (tick.tick == 11) {
      fast_ended.acquire();
      wait_until_it_sleeps(thread);
    }
  };
  Executive executive(fake.options);
  executive.add_task(spec_of("slow", 20, "shared"), slow);
  TaskSpec spec = spec_of("fast", 10, "shared");
  spec.offset_ticks = 1;
  spec.deadline_ns = 5 * ms;
  executive.add_task(spec, fast);
  const RunResult result = executive.run(fake.stop);
  EXPECT_EQ(order, (std::vector<std::string>{"slow", "fast", "fast"}));
  EXPECT_EQ(result.tasks[0].deadline_misses, 0U);
  EXPECT_EQ(result.tasks[1].deadline_misses, 1U);
  ASSERT_EQ(result.tasks[1].misses.size(), 1U);
  EXPECT_EQ(result.tasks[1].misses[0].cause, MissCause::earlier_task);
  EXPECT_EQ(result.tasks[1].misses[0].lateness_ns, 1 * ms);
}

TEST(OwnThread, AbortedBeforeItsThreadCameToItItNeverStarts) {
  FakeRun fake(12);
  std::binary_semaphore slow_may_end{0}, slow_started{0};
  ScriptedTask slow([&](const TickInfo&) {
    slow_started.release();
    slow_may_end.acquire();
  });
  std::atomic<int> steps{0}, aborts{0}, publications{0};
  ScriptedTask waiting([&](const TickInfo&) { ++steps; });
  waiting.on_abort = [&] { ++aborts; };
  waiting.on_publish = [&](const TickInfo&) { ++publications; };
  fake.hooks.on_end = [&](const TickInfo& tick) {
    if (tick.tick == 0) slow_started.acquire();
    if (tick.tick == 10) slow_may_end.release();
  };
  Executive executive(fake.options);
  executive.add_task(spec_of("slow", 12, "shared"), slow);
  TaskSpec spec = spec_of("waiting", 12, "shared");
  spec.offset_ticks = 1;
  spec.deadline_ns = 4 * ms;
  spec.overrun = OverrunPolicy::abort;
  executive.add_task(spec, waiting);
  const RunResult result = executive.run(fake.stop);
  EXPECT_EQ(steps, 0);
  EXPECT_EQ(aborts, 0) << "a step that does not run can not be asked to stop";
  EXPECT_EQ(publications, 0);
  EXPECT_EQ(result.tasks[1].runs, 0U);
  EXPECT_EQ(result.tasks[1].aborted, 1U);
  EXPECT_EQ(result.tasks[1].deadline_misses, 1U);
  ASSERT_EQ(result.tasks[1].misses.size(), 1U);
  EXPECT_EQ(result.tasks[1].misses[0].cause, MissCause::earlier_task);
  EXPECT_EQ(result.tasks[1].wall.count(), 0U);
}

TEST(OwnThread, LiveSnapshotCanBeReadWhileItRuns) {
  MonotonicClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  std::atomic<bool> stop{false};
  ScriptedTask base, own;
  Executive executive(options);
  executive.add_task(spec_of("base"), base);
  executive.add_task(spec_of("own", 5, "own"), own);
  EXPECT_EQ(executive.live().ticks_begun, 0U);
  std::uint64_t looks = 0;
  std::thread reader([&] {
    LiveSnapshot last;
    // The heartbeat lets a reader wait for ticks instead of guessing a time.
    while (last.ticks_begun < 50) {
      const LiveSnapshot now = executive.live();
      EXPECT_GE(now.ticks_begun, last.ticks_begun);
      EXPECT_GE(now.run_time_ns, last.run_time_ns);
      last = now;
      ++looks;
      std::this_thread::yield();
    }
    EXPECT_GT(last.tasks[0].runs, 40U);
    EXPECT_LE(last.tasks[0].slack_min_ns, ms);
    stop = true;
  });
  const RunResult result = executive.run(stop);
  reader.join();
  EXPECT_GT(looks, 0U);
  const LiveSnapshot last = executive.live();
  EXPECT_EQ(last.ticks_begun, result.ticks);
  EXPECT_EQ(last.tasks[1].runs, result.tasks[1].runs);
  EXPECT_EQ(last.tasks[1].slack_min_ns, result.tasks[1].slack_min_ns);
  EXPECT_EQ(last.tasks[0].deadline_misses, result.tasks[0].deadline_misses);
}

}  // namespace
}  // namespace hil::executive
