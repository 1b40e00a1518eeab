// Tasks that run on threads beside the base thread. Base time is fake and stands still while a tick runs; the
// other threads are real. Semaphores decide when a step ends, so that each test has one interleaving.

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::FakeRun;
using test::ScriptedTask;
using test::spec_of;
using test::wait_until_thread_sleeps;
using Ticks = std::vector<std::uint64_t>;
constexpr std::int64_t ms = 1'000'000;

/// A task with a period of 4 ticks whose steps end when the test permits it; it records what was published
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
      EXPECT_EQ(info.tick, out) << "the outputs of another run";
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
    return fake.run({{spec, &task}});
  }
  /// Ends the current step and waits until the executive can see that.
  void end_step() {
    may_end.release();
    ended.acquire();
    wait_until_thread_sleeps(thread);
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

TEST(TaskThread, OutputsArePublishedAtTheDeadlineTick) {
  FakeRun fake(13);
  HeldTask held(fake);
  held.at_tick = [&](std::uint64_t tick) {
    if (tick % 4 == 1) held.end_step();
  };
  held.may_end.release();  // for the run released in the last tick
  const RunResult result = held.run(OverrunPolicy::skip);
  EXPECT_EQ(held.latched, (Ticks{0, 4, 8, 12}));
  EXPECT_EQ(held.published, (std::vector<HeldTask::Published>{{0, 4}, {4, 8}, {8, 12}}));
  EXPECT_EQ(result.tasks[0].runs, 4U) << "the last run completes and is not published";
  EXPECT_EQ(result.tasks[0].deadline_misses, 0U);
}

TEST(TaskThread, PolicySkipDropsReleasesAndPublishesLate) {
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
  EXPECT_EQ(task.overruns, 1U) << "one run overran, whatever the number of releases";
  EXPECT_EQ(task.skipped, 2U) << "releases 4 and 8";
  ASSERT_EQ(task.misses.size(), 1U);
  EXPECT_EQ(task.misses[0].tick, 0U);
  EXPECT_EQ(task.misses[0].lateness_ns, 6 * ms);
}

TEST(TaskThread, PolicyQueueKeepsOneReleaseAndRunsItNext) {
  FakeRun fake(20);
  HeldTask held(fake);
  held.at_tick = [&](std::uint64_t tick) {
    if (tick == 10 || tick == 11 || tick == 13 || tick == 17) held.end_step();
  };
  std::vector<std::pair<TickInfo, std::uint64_t>> queued;
  held.task.on_queue = [&](const TickInfo& info) { queued.emplace_back(info, held.now_tick); };
  const RunResult result = held.run(OverrunPolicy::queue);
  EXPECT_EQ(held.latched, (Ticks{0, 4, 12, 16})) << "release 4 was queued, 8 skipped";
  ASSERT_EQ(queued.size(), 1U);
  EXPECT_EQ(queued[0].first.tick, 4U);
  EXPECT_EQ(queued[0].first.time_ns, 4 * ms);
  EXPECT_EQ(queued[0].first.run, 1U);
  EXPECT_EQ(queued[0].second, 4U) << "at the tick of its release, whose world its run has to read";
  EXPECT_EQ(held.published, (std::vector<HeldTask::Published>{{0, 10}, {4, 11}, {12, 16}}));
  const TaskResult& task = result.tasks[0];
  EXPECT_EQ(task.runs, 4U);
  EXPECT_EQ(task.deadline_misses, 2U);
  EXPECT_EQ(task.overruns, 1U);
  EXPECT_EQ(task.skipped, 1U);
  ASSERT_EQ(task.misses.size(), 2U);
  EXPECT_EQ(task.misses[1].tick, 4U);
  EXPECT_EQ(task.misses[1].lateness_ns, 3 * ms);
  EXPECT_EQ(task.misses[1].cause, task.misses[0].cause) << "it was late since the previous run was";
}

TEST(TaskThread, PolicyAbortEndsTheStepAndDropsItsOutputs) {
  FakeRun fake(20);
  HeldTask held(fake);
  held.at_tick = [&](std::uint64_t tick) {
    if (tick == 1) held.started.acquire();  // only a running step can be aborted
    if (tick == 5) {
      held.ended.acquire();  // ended by abort() in tick 4
      wait_until_thread_sleeps(held.thread);
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

TEST(TaskThread, TasksOfOneThreadRunOneAfterTheOther) {
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
      wait_until_thread_sleeps(thread);
    } else if (tick.tick == 11) {
      fast_ended.acquire();
      wait_until_thread_sleeps(thread);
    }
  };
  TaskSpec spec = spec_of("fast", 10, "shared");
  spec.offset_ticks = 1;
  spec.deadline_ns = 5 * ms;
  const RunResult result = fake.run({{spec_of("slow", 20, "shared"), &slow}, {spec, &fast}});
  EXPECT_EQ(order, (std::vector<std::string>{"slow", "fast", "fast"}));
  EXPECT_EQ(result.tasks[0].deadline_misses, 0U);
  EXPECT_EQ(result.tasks[1].deadline_misses, 1U);
  ASSERT_EQ(result.tasks[1].misses.size(), 1U);
  EXPECT_EQ(result.tasks[1].misses[0].cause, MissCause::earlier_task);
  EXPECT_EQ(result.tasks[1].misses[0].lateness_ns, 1 * ms);
}

TEST(TaskThread, RunsAbortedBeforeTheirStartNeverStart) {
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
  TaskSpec spec = spec_of("waiting", 12, "shared");
  spec.offset_ticks = 1;
  spec.deadline_ns = 4 * ms;
  spec.overrun = OverrunPolicy::abort;
  const RunResult result = fake.run({{spec_of("slow", 12, "shared"), &slow}, {spec, &waiting}});
  EXPECT_EQ(steps, 0);
  EXPECT_EQ(aborts, 0) << "there is no running step to abort";
  EXPECT_EQ(publications, 0);
  EXPECT_EQ(result.tasks[1].runs, 0U);
  EXPECT_EQ(result.tasks[1].aborted, 1U);
  EXPECT_EQ(result.tasks[1].deadline_misses, 1U);
  ASSERT_EQ(result.tasks[1].misses.size(), 1U);
  EXPECT_EQ(result.tasks[1].misses[0].cause, MissCause::earlier_task);
  EXPECT_EQ(result.tasks[1].wall.count(), 0U);
}

TEST(TaskThread, LiveSnapshotsAreReadDuringTheRun) {
  MonotonicClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  std::atomic<bool> stop{false};
  ScriptedTask base, threaded;
  Executive executive(options);
  executive.add_task(spec_of("base"), base);
  executive.add_task(spec_of("threaded", 5, "threaded"), threaded);
  EXPECT_EQ(executive.live().ticks_begun, 0U);
  std::uint64_t readings = 0;
  std::thread reader([&] {
    LiveSnapshot last;
    while (last.ticks_begun < 50) {
      const LiveSnapshot now = executive.live();
      EXPECT_GE(now.ticks_begun, last.ticks_begun);
      EXPECT_GE(now.run_time_ns, last.run_time_ns);
      last = now;
      ++readings;
      std::this_thread::yield();
    }
    EXPECT_GT(last.tasks[0].runs, 40U);
    EXPECT_LE(last.tasks[0].slack_min_ns, ms);
    stop = true;
  });
  const RunResult result = executive.run(stop);
  reader.join();
  EXPECT_GT(readings, 0U);
  const LiveSnapshot last = executive.live();
  EXPECT_EQ(last.ticks_begun, result.ticks);
  EXPECT_EQ(last.tasks[1].runs, result.tasks[1].runs);
  EXPECT_EQ(last.tasks[1].slack_min_ns, result.tasks[1].slack_min_ns);
  EXPECT_EQ(last.tasks[0].deadline_misses, result.tasks[0].deadline_misses);
}

}  // namespace
}  // namespace hil::executive
