// The stages of a tick and idle add up to the period, and records are never lost silently.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <thread>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using testing::FakeRun;
using testing::ScriptedTask;
using testing::spec_of;
constexpr std::int64_t us = 1'000;
constexpr std::int64_t ms = 1'000'000;

std::int64_t sum_of_stages(const BaseResult& base) {
  return base.wake.total_ns() + base.begin.total_ns() + base.publish.total_ns() + base.tasks.total_ns() +
         base.end.total_ns() + base.idle.total_ns();
}

TEST(Accounting, StagesAndIdleAddUpToThePeriodToTheNanosecond) {
  FakeRun fake(10);
  fake.clock.oversleep_ns = [](std::int64_t) { return 17'003; };
  fake.hooks.on_begin = [&](const TickInfo&) { fake.work(10'001); };
  fake.hooks.on_end = [&](const TickInfo&) { fake.work(40'007); };
  ScriptedTask first([&](const TickInfo&) { fake.work(200'011); });
  ScriptedTask second([&](const TickInfo&) { fake.work(100'013); });
  ScriptedTask own;
  own.on_publish = [&](const TickInfo&) { fake.work(5'021); };
  Executive executive(fake.options);
  executive.add_task(spec_of("first"), first);
  executive.add_task(spec_of("second"), second);
  const RunResult result = executive.run(fake.stop);
  ASSERT_EQ(result.trace.ticks.size(), 10U);
  for (const TickSpan& tick : result.trace.ticks) {
    EXPECT_EQ(tick.awake_ns - tick.frame_begin_ns, 17'003);
    EXPECT_EQ(tick.begun_ns - tick.awake_ns, 10'001);
    EXPECT_EQ(tick.published_ns - tick.begun_ns, 0);
    EXPECT_EQ(tick.worked_ns - tick.published_ns, 300'024);
    EXPECT_EQ(tick.ended_ns - tick.worked_ns, 40'007);
    EXPECT_EQ(tick.frame_end_ns - tick.ended_ns, ms - 17'003 - 10'001 - 300'024 - 40'007);
    EXPECT_EQ(tick.frame_end_ns - tick.frame_begin_ns, ms);
  }
  EXPECT_EQ(sum_of_stages(result.base), 10 * ms);
  ASSERT_EQ(result.trace.tasks.size(), 20U);
  EXPECT_EQ(result.trace.tasks[1].start_ns, 17'003 + 10'001 + 200'011);
  EXPECT_EQ(result.tasks[1].wake_latency.max_ns(), 17'003 + 10'001 + 200'011);
  EXPECT_EQ(result.tasks[1].cpu.max_ns(), 100'013);
}

TEST(Accounting, StagesAddUpAcrossOverrunsAndSkippedTicks) {
  FakeRun fake(100);
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.tick % 10 == 3) fake.work(2'345'678);
    if (tick.tick == 57) fake.work(20'123'456);
  });
  TaskSpec spec = spec_of("t");
  spec.overrun = OverrunPolicy::queue;
  Executive executive(fake.options);
  executive.add_task(spec, task);
  const RunResult result = executive.run(fake.stop);
  EXPECT_GT(result.base.skipped_ticks, 0U);
  EXPECT_GT(result.base.late_ticks, 0U);
  EXPECT_EQ(sum_of_stages(result.base), 100 * ms);
  for (std::size_t i = 1; i < result.trace.ticks.size(); ++i) {
    EXPECT_EQ(result.trace.ticks[i].frame_begin_ns, result.trace.ticks[i - 1].frame_end_ns)
        << "no gap, no overlap";
  }
}

TEST(Accounting, StagesMatchWhatAnotherWatchMeasuresInRealTime) {
  MonotonicClock clock;
  testing::ScriptedHooks hooks;
  ExecutiveOptions options;
  options.clock = &clock;
  options.hooks = &hooks;
  options.duration_ticks = 100;
  options.base_period_ns = 2 * ms;
  options.catch_up_ticks = 1'000;
  // The test's own stamps: the length of the hook and of the task, and the whole run.
  std::int64_t hook_ns = 0, task_ns = 0, first_ns = 0, last_ns = 0;
  const auto spin_for = [&](std::int64_t span_ns) {
    const std::int64_t begin_ns = clock.now_ns();
    while (clock.now_ns() - begin_ns < span_ns) {
    }
    return clock.now_ns() - begin_ns;
  };
  hooks.on_begin = [&](const TickInfo& tick) {
    if (tick.tick == 0) first_ns = clock.now_ns();
    hook_ns += spin_for(50 * us);
  };
  hooks.on_end = [&](const TickInfo&) { last_ns = clock.now_ns(); };
  ScriptedTask task([&](const TickInfo&) { task_ns += spin_for(100 * us); });
  Executive executive(options);
  executive.add_task(spec_of("t"), task);
  const std::atomic<bool> stop{false};
  const RunResult result = executive.run(stop);
  ASSERT_EQ(result.ticks, 100U);
  EXPECT_GE(result.base.begin.total_ns(), hook_ns);
  EXPECT_GE(result.tasks[0].wall.total_ns(), task_ns);
  EXPECT_GE(result.base.tasks.total_ns(), result.tasks[0].wall.total_ns());
  for (const TickSpan& tick : result.trace.ticks) {
    if (tick.ended_ns <= tick.frame_end_ns &&
        tick.frame_begin_ns == static_cast<std::int64_t>(tick.tick) * 2 * ms &&
        tick.frame_end_ns == tick.frame_begin_ns + 2 * ms) {
      continue;
    }
    // Only a tick that took longer than its period, or the one after it, has another frame.
    EXPECT_TRUE(tick.ended_ns == tick.frame_end_ns || tick.frame_begin_ns % (2 * ms) != 0) << tick.tick;
  }
  const TickSpan& last = result.trace.ticks.back();
  EXPECT_EQ(sum_of_stages(result.base), last.frame_end_ns);
  // From the first hook to the last one, by the test's watch and by the stages: apart by a few clock
  // readings.
  const std::int64_t by_stages_ns = last.ended_ns - result.trace.ticks.front().awake_ns;
  EXPECT_GE(by_stages_ns, last_ns - first_ns);
}

TEST(Accounting, FullRingsLoseRecordsButNotCounts) {
  FakeRun fake(2'000);
  fake.options.accounting.records_per_thread = 4;
  ScriptedTask task([&](const TickInfo&) { fake.work(10); });
  Executive executive(fake.options);
  executive.add_task(spec_of("t"), task);
  const RunResult result = executive.run(fake.stop);
  EXPECT_EQ(result.tasks[0].runs, 2'000U);
  EXPECT_GT(result.lost_records, 0U) << "2000 ticks take the blink of an eye: 4 records can not hold them";
  EXPECT_EQ(result.tasks[0].wall.count() + result.base.wake.count() + result.lost_records, 4'000U);
}

TEST(Accounting, KeepsTheFirstMissesAndCountsAll) {
  FakeRun fake(100);
  fake.options.accounting.kept_misses_per_task = 5;
  TaskSpec spec = spec_of("t", 2);
  spec.deadline_ns = 100 * us;
  // The worst is none of the first.
  ScriptedTask task([&](const TickInfo& tick) { fake.work(tick.tick == 60 ? 450 * us : 150 * us); });
  Executive executive(fake.options);
  executive.add_task(spec, task);
  const RunResult result = executive.run(fake.stop);
  EXPECT_EQ(result.tasks[0].deadline_misses, 50U);
  EXPECT_EQ(result.tasks[0].misses_by_cause[static_cast<std::size_t>(MissCause::own_work)], 50U);
  EXPECT_EQ(result.tasks[0].worst_lateness_ns, 350 * us);
  ASSERT_EQ(result.tasks[0].misses.size(), 5U);
  EXPECT_EQ(result.tasks[0].misses[4].tick, 8U);
  EXPECT_EQ(result.tasks[0].misses[4].lateness_ns, 50 * us);
  EXPECT_EQ(result.tasks[0].misses[4].cause, MissCause::own_work);
}

TEST(Accounting, KeepsTheFirstTimesThatTicksWereGivenUpAndCountsAll) {
  FakeRun fake(200);
  fake.options.accounting.kept_misses_per_task = 3;
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.tick % 20 == 0) fake.work(10 * ms + 500 * us);
  });
  Executive executive(fake.options);
  executive.add_task(spec_of("t"), task);
  const RunResult result = executive.run(fake.stop);
  EXPECT_EQ(result.base.skips.size(), 3U);
  EXPECT_EQ(result.base.times_skipped, 10U);
  EXPECT_EQ(result.ticks + result.base.skipped_ticks, 200U);
}

TEST(Accounting, TheTraceHasTheConfiguredLength) {
  FakeRun fake(1'000);
  fake.options.accounting.trace_ns = 100 * ms;
  ScriptedTask task;
  Executive executive(fake.options);
  executive.add_task(spec_of("t", 10), task);
  const RunResult result = executive.run(fake.stop);
  ASSERT_EQ(result.trace.ticks.size(), 100U);
  EXPECT_EQ(result.trace.ticks.front().tick, 900U);
  ASSERT_EQ(result.trace.tasks.size(), 10U);
  EXPECT_EQ(result.trace.tasks.front().tick, 900U);
}

TEST(Accounting, NoTraceWhenNoneIsWanted) {
  FakeRun fake(10);
  fake.options.accounting.trace_ns = 0;
  ScriptedTask task;
  Executive executive(fake.options);
  executive.add_task(spec_of("t"), task);
  const RunResult result = executive.run(fake.stop);
  EXPECT_TRUE(result.trace.ticks.empty());
  EXPECT_TRUE(result.trace.tasks.empty());
}

TEST(Accounting, CountsCpuTimeBlockedTimeAndPageFaultsOfEachTask) {
  FakeRun fake(10);
  ScriptedTask task([&](const TickInfo&) {
    fake.work(100 * us);
    fake.clock.advance(50 * us);
    fake.probe.minor_faults += 2;
    fake.probe.major_faults += 1;
  });
  task.blocked_ns = 50 * us;
  task.gpu_ns = 30 * us;
  ScriptedTask other([&](const TickInfo&) { fake.work(10 * us); });
  Executive executive(fake.options);
  executive.add_task(spec_of("t"), task);
  executive.add_task(spec_of("other"), other);
  const RunResult result = executive.run(fake.stop);
  EXPECT_EQ(result.tasks[0].cpu.max_ns(), 100 * us);
  EXPECT_EQ(result.tasks[0].wall.max_ns(), 150 * us);
  EXPECT_EQ(result.tasks[0].blocked.max_ns(), 50 * us);
  EXPECT_EQ(result.tasks[0].gpu.max_ns(), 30 * us);
  EXPECT_EQ(result.tasks[0].minor_faults, 20);
  EXPECT_EQ(result.tasks[0].major_faults, 10);
  EXPECT_EQ(result.tasks[1].cpu.max_ns(), 10 * us);
  EXPECT_EQ(result.tasks[1].minor_faults, 0) << "a neighbour's faults are its own";
}

}  // namespace
}  // namespace hil::executive
