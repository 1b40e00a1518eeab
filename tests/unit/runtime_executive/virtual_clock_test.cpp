// Under the virtual clock nothing is late or lost, and signals have the values that they have in real time.

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::ScriptedTask;
using test::spec_of;
constexpr std::int64_t ms = 1'000'000;

/// Three tasks that feed each other: a counter on the base thread, a filter on a second thread with a
/// deadline shorter than its period, and a sum on a third thread. A fourth task records what the base thread
/// sees in each tick.
struct Chain {
  double counter = 0, filtered = 0, summed = 0;  // the signals, used by the base thread only
  std::vector<double> seen;

  RunResult run(Clock& clock, std::int64_t step_delay_ms) {
    ScriptedTask count(
        [&](const TickInfo& tick) { counter += 1.0 + 0.001 * static_cast<double>(tick.tick % 7); });
    double filter_in = 0, filter_state = 0, filter_out = 0;
    ScriptedTask filter([&](const TickInfo&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(step_delay_ms));
      filter_state = 0.75 * filter_state + 0.25 * filter_in;
      filter_out = filter_state;
    });
    filter.on_latch = [&](const TickInfo&) { filter_in = counter + 0.1 * summed; };
    filter.on_publish = [&](const TickInfo&) { filtered = filter_out; };
    double sum_in = 0, sum_out = 0;
    ScriptedTask sum([&](const TickInfo& tick) { sum_out += sum_in * static_cast<double>(tick.run); });
    sum.on_latch = [&](const TickInfo&) { sum_in = filtered; };
    sum.on_publish = [&](const TickInfo&) { summed = sum_out; };
    ScriptedTask record([&](const TickInfo&) { seen.insert(seen.end(), {counter, filtered, summed}); });

    ExecutiveOptions options;
    options.clock = &clock;
    options.base_period_ns = 10 * ms;  // long, so that no deadline is missed on a busy machine
    options.duration_ticks = 60;
    options.catch_up_ticks = 1'000;
    TaskSpec filter_spec = spec_of("filter", 6, "filter");
    filter_spec.offset_ticks = 1;
    filter_spec.deadline_ns = 40 * ms;
    return test::run_tasks(options,
                           {{spec_of("count"), &count},
                            {filter_spec, &filter},
                            {spec_of("sum", 10, "sum"), &sum},
                            {spec_of("record"), &record}},
                           std::atomic<bool>{false});
  }
};

TEST(VirtualClock, GivesTheSameValuesAsRealTime) {
  VirtualClock virtual_clock;
  Chain reference;
  const RunResult virtual_result = reference.run(virtual_clock, 0);
  ASSERT_EQ(reference.seen.size(), 180U);
  EXPECT_NE(reference.summed, 0.0);

  // In real time the step takes longer than a tick, which must not change the values: real time is the
  // subject, so the step sleeps. A missed deadline does change the values; such a run is repeated, up to five
  // times.
  for (int attempt = 1;; ++attempt) {
    MonotonicClock monotonic_clock;
    Chain real;
    const RunResult result = real.run(monotonic_clock, 12);
    std::uint64_t misses = result.base.skipped_ticks;
    for (const TaskResult& task : result.tasks)
      misses += task.thread.empty() ? task.skipped : task.deadline_misses;
    if (misses > 0 && attempt < 5) continue;
    ASSERT_EQ(misses, 0U) << "five runs in a row missed deadlines of 40 and 100 ms";
    EXPECT_EQ(real.seen, reference.seen);
    for (std::size_t task = 0; task < result.tasks.size(); ++task) {
      EXPECT_EQ(result.tasks[task].runs, virtual_result.tasks[task].runs) << result.tasks[task].name;
    }
    break;
  }
}

TEST(VirtualClock, GivesTheSameValuesInEachRun) {
  VirtualClock first_clock, second_clock;
  Chain first, second;
  first.run(first_clock, 0);
  second.run(second_clock, 0);
  EXPECT_EQ(first.seen, second.seen);
}

TEST(VirtualClock, PublishesOutputsAtTheDeadlineTick) {
  test::ClockRun<VirtualClock> run(12);
  std::int64_t out = -1, visible = -1;
  ScriptedTask threaded([&](const TickInfo& tick) { out = static_cast<std::int64_t>(tick.run); });
  threaded.on_publish = [&](const TickInfo& tick) {
    visible = out;
    EXPECT_EQ(tick.tick, 5 * tick.run) << "publish gets the release of its run";
  };
  std::vector<std::int64_t> seen;
  ScriptedTask reader([&](const TickInfo&) { seen.push_back(visible); });
  TaskSpec spec = spec_of("threaded", 5, "threaded");
  spec.deadline_ns = 3 * ms;
  run.run({{spec, &threaded}, {spec_of("reader"), &reader}});
  EXPECT_EQ(seen, (std::vector<std::int64_t>{-1, -1, -1, 0, 0, 0, 0, 0, 1, 1, 1, 1}));
}

TEST(VirtualClock, IsNeverLateAndLosesNoRecord) {
  test::ClockRun<VirtualClock> run(20'000);
  run.options.accounting.records_per_thread = 16;
  run.options.realtime.scheduler = Scheduler::fifo;
  volatile double sink = 0;
  ScriptedTask slow([&](const TickInfo&) {
    for (int i = 0; i < 2'000; ++i)
      sink = sink + 1.0;
  });
  ScriptedTask threaded;
  const RunResult result =
      run.run({{spec_of("slow"), &slow}, {spec_of("threaded", 10, "threaded"), &threaded}});
  EXPECT_TRUE(result.virtual_clock);
  EXPECT_EQ(result.ticks, 20'000U);
  EXPECT_EQ(result.base.skipped_ticks + result.base.late_ticks, 0U);
  EXPECT_EQ(result.lost_records, 0U);
  EXPECT_EQ(result.tasks[0].wall.count(), 20'000U);
  EXPECT_EQ(result.tasks[1].wall.count(), 2'000U);
  for (const TaskResult& task : result.tasks) {
    EXPECT_EQ(task.deadline_misses + task.overruns + task.skipped, 0U);
    EXPECT_EQ(task.slack_min_ns, task.deadline_ns);
  }
  EXPECT_EQ(result.base.idle.total_ns(), 20'000 * ms) << "all of the virtual time is idle";
  EXPECT_GT(result.tasks[0].cpu.max_ns(), 0) << "CPU time is real";
  EXPECT_TRUE(result.realtime.degraded.empty()) << "no real-time scheduling is requested";
}

}  // namespace
}  // namespace hil::executive
