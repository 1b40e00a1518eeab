// The virtual clock: nothing is late, nothing is lost, and others see what they would see in real time.

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using testing::ScriptedTask;
using testing::spec_of;
constexpr std::int64_t ms = 1'000'000;

/// Three tasks that feed each other: a counter on the base thread, a filter on its own thread with a deadline
/// shorter than its period, and a sum on another own thread. What the base thread sees in each tick is the
/// record.
struct Chain {
  double counter = 0, filtered = 0, summed = 0;  // the "signals": base thread only
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
    options.base_period_ns = 10 * ms;  // long, so that a busy machine misses no deadline
    options.duration_ticks = 60;
    options.catch_up_ticks = 1'000;
    Executive executive(options);
    executive.add_task(spec_of("count"), count);
    TaskSpec filter_spec = spec_of("filter", 6, "filter");
    filter_spec.offset_ticks = 1;
    filter_spec.deadline_ns = 40 * ms;
    executive.add_task(filter_spec, filter);
    executive.add_task(spec_of("sum", 10, "sum"), sum);
    executive.add_task(spec_of("record"), record);
    const std::atomic<bool> stop{false};
    return executive.run(stop);
  }
};

TEST(VirtualClock, OthersSeeTheSameValuesInBothClockModes) {
  VirtualClock virtual_clock;
  Chain reference;
  const RunResult virtual_result = reference.run(virtual_clock, 0);
  ASSERT_EQ(reference.seen.size(), 180U);
  EXPECT_NE(reference.summed, 0.0);

  // In real time the step takes longer than a tick; that must not show. A busy machine may miss a deadline,
  // which would rightly change the values: then the run proves nothing and is repeated, up to five times.
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

TEST(VirtualClock, TwoRunsAreIdentical) {
  VirtualClock first_clock, second_clock;
  Chain first, second;
  first.run(first_clock, 0);
  second.run(second_clock, 0);
  EXPECT_EQ(first.seen, second.seen);
}

TEST(VirtualClock, OutputsAppearAtTheDeadlineTickAndNotBefore) {
  VirtualClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  options.duration_ticks = 12;
  std::int64_t out = -1, visible = -1;
  ScriptedTask own([&](const TickInfo& tick) { out = static_cast<std::int64_t>(tick.run); });
  own.on_publish = [&](const TickInfo& tick) {
    visible = out;
    EXPECT_EQ(tick.tick, 5 * tick.run) << "publish is told the release of its run";
  };
  std::vector<std::int64_t> seen;
  ScriptedTask stall_detector([&](const TickInfo&) { seen.push_back(visible); });
  Executive executive(options);
  TaskSpec spec = spec_of("own", 5, "own");
  spec.deadline_ns = 3 * ms;
  executive.add_task(spec, own);
  executive.add_task(spec_of("stall_detector"), stall_detector);
  const std::atomic<bool> stop{false};
  executive.run(stop);
  EXPECT_EQ(seen, (std::vector<std::int64_t>{-1, -1, -1, 0, 0, 0, 0, 0, 1, 1, 1, 1}));
}

TEST(VirtualClock, NothingIsEverLateAndNoRecordIsLost) {
  VirtualClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  options.duration_ticks = 20'000;
  options.accounting.records_per_thread = 16;
  options.realtime.scheduler = Scheduler::fifo;
  volatile double sink = 0;
  ScriptedTask slow([&](const TickInfo&) {
    for (int i = 0; i < 2'000; ++i)
      sink = sink + 1.0;
  });
  ScriptedTask own;
  Executive executive(options);
  executive.add_task(spec_of("slow"), slow);
  executive.add_task(spec_of("own", 10, "own"), own);
  const std::atomic<bool> stop{false};
  const RunResult result = executive.run(stop);
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
  EXPECT_TRUE(result.realtime.degraded.empty()) << "no real-time scheduling is asked for";
}

}  // namespace
}  // namespace hil::executive
