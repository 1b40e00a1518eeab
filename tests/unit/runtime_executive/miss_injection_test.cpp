// Injects each cause of a miss into a complete executive on fake time and checks that it is named.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <thread>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::FakeRun;
using test::ScriptedTask;
using test::spec_of;
constexpr std::int64_t us = 1'000;
constexpr std::int64_t ms = 1'000'000;

/// Ten ticks of a task with a deadline of 0.5 ms; each test injects a delay in tick 5.
struct Injection {
  FakeRun fake{10};
  ScriptedTask task;
  TaskSpec spec = spec_of("t");

  Injection() { spec.deadline_ns = 500 * us; }
  std::int64_t due_ns(std::uint64_t tick) const { return first_ns + static_cast<std::int64_t>(tick) * ms; }

  void expect_one_miss(const RunResult& result, MissCause cause, std::int64_t lateness_ns) const {
    const TaskResult& counted = result.tasks.back();
    EXPECT_EQ(counted.deadline_misses, 1U);
    ASSERT_EQ(counted.misses.size(), 1U);
    EXPECT_EQ(counted.misses[0].tick, 5U);
    EXPECT_STREQ(to_string(counted.misses[0].cause), to_string(cause));
    EXPECT_EQ(counted.misses[0].lateness_ns, lateness_ns);
  }
  void run_and_expect(MissCause cause, std::int64_t lateness_ns) {
    expect_one_miss(fake.run({{spec, &task}}), cause, lateness_ns);
  }
  /// Waits until the pause detector has read its clock a few times.
  void wait_for_detector() {
    for (const int before = fake.probe.host_time_readings; fake.probe.host_time_readings < before + 4;)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::int64_t first_ns = fake.clock.now_ns() + ms;
};

TEST(MissInjection, LateWakeup) {
  Injection run;
  run.fake.clock.oversleep_ns = [&](std::int64_t wake_ns) { return wake_ns == run.due_ns(5) ? 700 * us : 0; };
  run.run_and_expect(MissCause::late_wake_up, 200 * us);
}

TEST(MissInjection, OwnWork) {
  Injection run;
  run.task.on_step = [&](const TickInfo& tick) { run.fake.work(tick.tick == 5 ? 800 * us : 100 * us); };
  run.run_and_expect(MissCause::own_work, 300 * us);
}

TEST(MissInjection, WorkBeyondTheBudgetIsCounted) {
  Injection run;
  run.spec.budget_ns = 150 * us;
  run.fake.clock.oversleep_ns = [&](std::int64_t wake_ns) { return wake_ns == run.due_ns(5) ? 120 * us : 0; };
  run.task.on_step = [&](const TickInfo& tick) {
    if (tick.tick == 5) run.fake.work(400 * us);
    if (tick.tick == 7) run.fake.work(200 * us);  // over budget, but in time
  };
  const RunResult result = run.fake.run({{run.spec, &run.task}});
  run.expect_one_miss(result, MissCause::own_work, 20 * us);
  EXPECT_EQ(result.tasks[0].over_budget, 2U);
}

TEST(MissInjection, Database) {
  Injection run;
  run.task.on_step = [&](const TickInfo& tick) {
    run.task.blocked_ns = tick.tick == 5 ? 600 * us : 0;
    run.fake.clock.advance(run.task.blocked_ns);
    run.fake.work(50 * us);
  };
  run.run_and_expect(MissCause::database, 150 * us);
}

TEST(MissInjection, EarlierTask) {
  Injection run;
  ScriptedTask earlier([&](const TickInfo& tick) {
    if (tick.tick == 5) run.fake.work(600 * us);
  });
  run.expect_one_miss(run.fake.run({{spec_of("earlier"), &earlier}, {run.spec, &run.task}}),
                      MissCause::earlier_task, 100 * us);
}

TEST(MissInjection, HookBeforeTheTaskIsAnEarlierTask) {
  Injection run;
  run.fake.hooks.on_begin = [&](const TickInfo& tick) {
    if (tick.tick == 5) run.fake.work(600 * us);
  };
  run.run_and_expect(MissCause::earlier_task, 100 * us);
}

TEST(MissInjection, EarlierTaskInTheTickBefore) {
  Injection run;
  ScriptedTask late([&](const TickInfo& tick) {
    if (tick.tick == 4) run.fake.work(1'600 * us);
  });
  const RunResult result = run.fake.run({{run.spec, &run.task}, {spec_of("late"), &late}});
  ASSERT_EQ(result.tasks[0].misses.size(), 1U);
  EXPECT_EQ(result.tasks[0].misses[0].tick, 5U);
  EXPECT_EQ(result.tasks[0].misses[0].cause, MissCause::earlier_task);
  EXPECT_EQ(result.tasks[0].misses[0].lateness_ns, 100 * us);
}

TEST(MissInjection, TicksThatRunBackToBackAfterALateWakeupNameTheWakeup) {
  Injection run;
  run.fake.clock.oversleep_ns = [&](std::int64_t wake_ns) {
    return wake_ns == run.due_ns(5) ? 2'700 * us : 0;
  };
  const RunResult result = run.fake.run({{run.spec, &run.task}});
  ASSERT_EQ(result.tasks[0].misses.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(result.tasks[0].misses[i].tick, 5 + i);
    EXPECT_EQ(result.tasks[0].misses[i].cause, MissCause::late_wake_up);
    EXPECT_EQ(result.tasks[0].misses[i].lateness_ns, 2'200 * us - static_cast<std::int64_t>(i) * ms);
  }
}

TEST(MissInjection, Preempted) {
  Injection run;
  run.task.on_step = [&](const TickInfo& tick) {
    run.fake.work(50 * us);
    if (tick.tick == 5)
      run.fake.clock.advance(600 * us);  // the clock advances, the thread's CPU time does not
  };
  run.run_and_expect(MissCause::preempted, 150 * us);
}

TEST(MissInjection, PageFault) {
  Injection run;
  run.task.on_step = [&](const TickInfo& tick) {
    run.fake.work(50 * us);
    if (tick.tick != 5) return;
    run.fake.clock.advance(600 * us);
    run.fake.probe.major_faults += 1;
  };
  run.run_and_expect(MissCause::page_fault, 150 * us);
}

TEST(MissInjection, HostPauseThatTheDetectorSees) {
  Injection run;
  run.fake.options.catch_up_ticks = 1'000;
  run.fake.probe.host_ns = run.fake.clock.now_ns();
  run.spec.deadline_ns = 1 * ms;
  run.task.on_step = [&](const TickInfo& tick) {
    if (tick.tick != 5) return;
    // Both clocks move by 40 ms while the detector sleeps.
    run.fake.probe.host_ns = run.fake.clock.now_ns();
    run.wait_for_detector();
    run.fake.clock.advance(40 * ms);
    run.fake.probe.host_ns = run.fake.clock.now_ns();
    run.wait_for_detector();
  };
  run.run_and_expect(MissCause::host_pause, 39 * ms);
}

TEST(MissInjection, HostPauseAsStolenTime) {
  Injection run;
  run.fake.options.catch_up_ticks = 1'000;
  run.fake.probe.host_ns = run.fake.clock.now_ns();
  run.spec.deadline_ns = 1 * ms;
  run.task.on_step = [&](const TickInfo& tick) {
    if (tick.tick != 5) return;
    run.fake.probe.host_ns = run.fake.clock.now_ns();
    run.wait_for_detector();  // it has read the reference of the stolen time
    run.fake.clock.advance(12 * ms);
    // The detector's clock advances in steps that are no pauses, while the stolen time grows.
    for (int step = 0; step < 12; ++step) {
      run.fake.probe.host_ns += ms;
      run.fake.probe.steal_ns += 900 * us;
      run.wait_for_detector();
    }
  };
  run.run_and_expect(MissCause::host_pause, 11 * ms);
}

}  // namespace
}  // namespace hil::executive
