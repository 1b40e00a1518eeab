// When ticks run and tasks are released, on fake time.

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::FakeRun;
using test::ScriptedTask;
using test::spec_of;
constexpr std::int64_t us = 1'000;
constexpr std::int64_t ms = 1'000'000;

std::vector<std::uint64_t> ticks_from(std::uint64_t first, std::uint64_t past) {
  std::vector<std::uint64_t> ticks;
  for (std::uint64_t tick = first; tick < past; ++tick)
    ticks.push_back(tick);
  return ticks;
}

TEST(Pacing, LateWakeUpsNeitherSkipNorHalveReleases) {
  // Every wake-up is late by a varying part of a period; pacing relative to the last wake-up would lose
  // ticks.
  FakeRun fake(1'000);
  int wakes = 0;
  fake.clock.oversleep_ns = [&](std::int64_t) { return (++wakes % 7) * 140 * us; };
  std::vector<std::uint64_t> every, fifth;
  std::vector<std::int64_t> lateness_ns;
  std::int64_t start_ns = fake.clock.now_ns() + ms;
  ScriptedTask fast([&](const TickInfo& tick) {
    every.push_back(tick.tick);
    lateness_ns.push_back(fake.clock.now_ns() - start_ns - tick.time_ns);
  });
  ScriptedTask slow([&](const TickInfo& tick) { fifth.push_back(tick.tick); });
  TaskSpec spec = spec_of("slow", 5);
  spec.offset_ticks = 3;
  const RunResult result = fake.run({{spec_of("fast"), &fast}, {spec, &slow}});
  EXPECT_EQ(every, ticks_from(0, 1'000));
  ASSERT_EQ(fifth.size(), 200U);
  for (std::size_t i = 0; i < fifth.size(); ++i)
    EXPECT_EQ(fifth[i], 5 * i + 3);
  for (const std::int64_t late_ns : lateness_ns)
    EXPECT_LT(late_ns, ms) << "absolute pacing: no drift";
  EXPECT_EQ(result.ticks, 1'000U);
  EXPECT_EQ(result.run_time_ns, 1'000 * ms);
  EXPECT_FALSE(result.stopped);
}

TEST(Pacing, TickInfoDescribesTheRelease) {
  FakeRun fake(20);
  std::vector<TickInfo> seen;
  ScriptedTask task([&](const TickInfo& tick) { seen.push_back(tick); });
  TaskSpec spec = spec_of("t", 4);
  spec.offset_ticks = 1;
  fake.run({{spec, &task}});
  ASSERT_EQ(seen.size(), 5U);
  EXPECT_EQ(seen[2].tick, 9U);
  EXPECT_EQ(seen[2].time_ns, 9 * ms);
  EXPECT_EQ(seen[2].period_ns, 4 * ms);
  EXPECT_EQ(seen[2].run, 2U);
}

TEST(Pacing, FewLateTicksRunBackToBack) {
  FakeRun fake(20);
  std::vector<std::uint64_t> short_task_ticks;
  ScriptedTask long_task([&](const TickInfo&) { fake.work(3'500 * us); });
  ScriptedTask short_task([&](const TickInfo& tick) { short_task_ticks.push_back(tick.tick); });
  TaskSpec long_task_spec = spec_of("long_task", 20);
  long_task_spec.offset_ticks = 5;
  const RunResult result = fake.run({{long_task_spec, &long_task}, {spec_of("short_task"), &short_task}});
  EXPECT_EQ(short_task_ticks, ticks_from(0, 20))
      << "the releases of short_task came while another task ran: they run late";
  EXPECT_EQ(result.base.skipped_ticks, 0U);
  EXPECT_EQ(result.base.late_ticks, 3U) << "ticks 6, 7, 8";
  EXPECT_EQ(result.tasks[1].skipped, 0U);
  EXPECT_EQ(result.tasks[1].overruns, 0U);
  EXPECT_EQ(result.tasks[1].deadline_misses, 3U)
      << "ticks 5, 6 and 7 finish after 3.5, 2.5, 1.5 ms; tick 8 after 0.5";
}

TEST(Pacing, LateTicksBeyondTheBoundAreSkippedAndReported) {
  FakeRun fake(30);
  fake.options.catch_up_ticks = 4;
  std::vector<std::uint64_t> short_task_ticks;
  TaskSpec long_task_spec = spec_of("long_task", 30);
  long_task_spec.offset_ticks = 5;
  ScriptedTask long_task([&](const TickInfo&) { fake.work(8'200 * us); });
  ScriptedTask short_task([&](const TickInfo& tick) {
    short_task_ticks.push_back(tick.tick);
    EXPECT_EQ(tick.time_ns, static_cast<std::int64_t>(tick.tick) * ms) << "run time follows real time";
  });
  ScriptedTask third;
  const RunResult result = fake.run(
      {{long_task_spec, &long_task}, {spec_of("short_task"), &short_task}, {spec_of("third", 3), &third}});
  std::vector<std::uint64_t> expected = ticks_from(0, 6);
  for (const std::uint64_t tick : ticks_from(13, 30))
    expected.push_back(tick);
  EXPECT_EQ(short_task_ticks, expected) << "tick 13 is the latest that is due at 13.2 ms";
  EXPECT_EQ(result.ticks, 23U);
  EXPECT_EQ(result.run_time_ns, 30 * ms);
  EXPECT_EQ(result.base.skipped_ticks, 7U);
  ASSERT_EQ(result.base.skips.size(), 1U);
  EXPECT_EQ(result.base.skips[0].tick, 6U);
  EXPECT_EQ(result.base.skips[0].count, 7U);
  EXPECT_EQ(result.base.skips[0].cause, MissCause::earlier_task);
  EXPECT_EQ(result.tasks[1].skipped, 7U);
  EXPECT_EQ(result.tasks[1].runs, 23U);
  EXPECT_EQ(result.tasks[2].skipped, 3U) << "its releases at 6, 9 and 12";
}

TEST(Pacing, SkipsAfterALateWakeUpNameTheWakeUp) {
  FakeRun fake(50);
  fake.clock.oversleep_ns = [&, first_ns = fake.clock.now_ns() + ms](std::int64_t wake_ns) {
    return wake_ns == first_ns + 10 * ms ? 20 * ms + 300 * us : 0;
  };
  ScriptedTask task;
  const RunResult result = fake.run({{spec_of("t"), &task}});
  ASSERT_EQ(result.base.skips.size(), 1U);
  EXPECT_EQ(result.base.skips[0].tick, 10U);
  EXPECT_EQ(result.base.skips[0].count, 20U);
  EXPECT_EQ(result.base.skips[0].cause, MissCause::late_wake_up);
  EXPECT_EQ(result.tasks[0].skipped, 20U);
  EXPECT_EQ(result.tasks[0].deadline_misses, 0U);
  EXPECT_EQ(result.base.wake.max_ns(), 20 * ms + 300 * us);
}

TEST(Pacing, TheLastTickAlwaysRuns) {
  FakeRun fake(10);
  std::vector<std::uint64_t> ticks;
  ScriptedTask task([&](const TickInfo& tick) {
    ticks.push_back(tick.tick);
    if (tick.tick == 2) fake.clock.advance(100 * ms);
  });
  TaskSpec spec = spec_of("t");
  spec.overrun = OverrunPolicy::queue;
  const RunResult result = fake.run({{spec, &task}});
  EXPECT_EQ(ticks, (std::vector<std::uint64_t>{0, 1, 2, 9}));
  EXPECT_EQ(result.ticks, 4U);
  EXPECT_EQ(result.base.skipped_ticks, 6U);
  EXPECT_EQ(result.run_time_ns, 10 * ms);
}

TEST(Pacing, OverrunPolicyDecidesWhichReleasesOfAnOverrunAreDropped) {
  // The run of tick 5 takes 3.5 ms, so the releases 6, 7 and 8 find the task running.
  struct Case {
    OverrunPolicy policy;
    std::uint64_t first_dropped, misses;
  };
  for (const auto& [policy, first_dropped, misses] :
       {Case{OverrunPolicy::skip, 6, 1}, Case{OverrunPolicy::queue, 7, 2}}) {
    SCOPED_TRACE(first_dropped);
    FakeRun fake(20);
    std::vector<std::uint64_t> ticks;
    ScriptedTask task([&](const TickInfo& tick) {
      ticks.push_back(tick.tick);
      if (tick.tick == 5) fake.work(3'500 * us);
    });
    TaskSpec spec = spec_of("t");
    spec.overrun = policy;
    const RunResult result = fake.run({{spec, &task}});
    std::vector<std::uint64_t> expected = ticks_from(0, first_dropped);
    for (const std::uint64_t tick : ticks_from(9, 20))
      expected.push_back(tick);
    EXPECT_EQ(ticks, expected);
    EXPECT_EQ(result.tasks[0].overruns, 1U);
    EXPECT_EQ(result.tasks[0].skipped, 9 - first_dropped);
    EXPECT_EQ(result.tasks[0].deadline_misses, misses);
    EXPECT_EQ(result.ticks, 20U) << "the ticks themselves run, so that other tasks are not affected";
  }
}

TEST(Pacing, MissWithoutAnOverrunIsNoOverrun) {
  FakeRun fake(40);
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.run == 1) fake.work(2 * ms);  // past its deadline, before its next release
  });
  TaskSpec spec = spec_of("t", 10);
  spec.deadline_ns = ms;
  const RunResult result = fake.run({{spec, &task}});
  EXPECT_EQ(result.tasks[0].deadline_misses, 1U);
  EXPECT_EQ(result.tasks[0].overruns, 0U);
  EXPECT_EQ(result.tasks[0].skipped, 0U);
  EXPECT_EQ(result.tasks[0].slack_min_ns, -1 * ms) << "slack: positive is good";
  EXPECT_EQ(result.tasks[0].slack_p50_ns, ms);
}

TEST(Pacing, WarmupRunsAreCountedApart) {
  FakeRun fake(20);
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.run < 3)
      fake.work(1'500 * us);
    else
      fake.work(100 * us);
  });
  TaskSpec spec = spec_of("t", 4);
  spec.deadline_ns = ms;
  spec.budget_ns = 200 * us;
  spec.warmup_runs = 3;
  const RunResult result = fake.run({{spec, &task}});
  const TaskResult& counted = result.tasks[0];
  EXPECT_EQ(counted.warmup_runs, 3U);
  EXPECT_EQ(counted.runs, 2U);
  EXPECT_EQ(counted.deadline_misses, 0U);
  EXPECT_EQ(counted.over_budget, 0U);
  EXPECT_EQ(counted.warmup_problems, 6U) << "three misses, three times over budget";
  EXPECT_TRUE(counted.misses.empty());
  EXPECT_EQ(counted.wall.max_ns(), 100 * us) << "histograms begin after the warm-up";
  EXPECT_EQ(counted.slack_min_ns, 900 * us);
}

}  // namespace
}  // namespace hil::executive
