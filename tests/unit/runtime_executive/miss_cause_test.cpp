#include "runtime/executive/miss_cause.hpp"

#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <vector>

namespace hil::executive {
namespace {

constexpr std::int64_t us = 1'000;

/// A run with a deadline of 1 ms that starts at its release and computes for 100 us.
RunEvidence quiet_run() {
  RunEvidence run;
  run.release_ns = 10'000 * us;
  run.base_wake_ns = run.release_ns;
  run.ready_ns = run.release_ns;
  run.start_ns = run.release_ns;
  run.finish_ns = run.release_ns + 100 * us;
  run.cpu_ns = 100 * us;
  run.deadline_ns = 1'000 * us;
  return run;
}

void compute(RunEvidence& run, std::int64_t for_ns) {
  run.cpu_ns = for_ns;
  run.finish_ns = run.start_ns + for_ns;
}

void delay_start(RunEvidence& run, std::int64_t by_ns) {
  run.start_ns += by_ns;
  run.finish_ns += by_ns;
}

struct Case {
  const char* name;
  void (*change)(RunEvidence&);                           ///< of a quiet run
  std::vector<std::pair<MissCause, std::int64_t>> parts;  ///< in us, the largest first
};

const Case cases[] = {
    {"late wake-up of the base thread",
     [](RunEvidence& run) {
       delay_start(run, 950 * us);
       run.base_wake_ns += 950 * us;
       run.ready_ns = run.start_ns;
     },
     {{MissCause::late_wake_up, 950}}},
    {"late wake-up of the task's thread",
     [](RunEvidence& run) {
       delay_start(run, 950 * us);
       run.ready_ns = run.release_ns + 5 * us;
     },
     {{MissCause::late_wake_up, 945}, {MissCause::earlier_task, 5}}},
    {"earlier task on the base thread",
     [](RunEvidence& run) {
       delay_start(run, 950 * us);
       run.base_wake_ns += 20 * us;
       run.ready_ns = run.start_ns;
     },
     {{MissCause::earlier_task, 930}, {MissCause::late_wake_up, 20}}},
    {"earlier task on a shared thread",
     [](RunEvidence& run) {
       delay_start(run, 950 * us);
       run.thread_free_ns = run.release_ns + 940 * us;
     },
     {{MissCause::earlier_task, 940}, {MissCause::late_wake_up, 10}}},
    {"work beyond the budget",
     [](RunEvidence& run) {
       run.budget_ns = 500 * us;
       delay_start(run, 300 * us);
       run.base_wake_ns = run.ready_ns = run.start_ns;
       compute(run, 900 * us);
     },
     {{MissCause::own_work, 400}, {MissCause::late_wake_up, 300}}},
    {"waiting longer than the work beyond the budget",
     [](RunEvidence& run) {
       run.budget_ns = 800 * us;
       delay_start(run, 300 * us);
       run.base_wake_ns = run.ready_ns = run.start_ns;
       compute(run, 900 * us);
     },
     {{MissCause::late_wake_up, 300}, {MissCause::own_work, 100}}},
    {"work beyond the deadline, without a budget",
     [](RunEvidence& run) { compute(run, 1'200 * us); },
     {{MissCause::own_work, 200}}},
    {"database",
     [](RunEvidence& run) {
       run.blocked_ns = 950 * us;
       run.finish_ns = run.start_ns + 1'050 * us;
     },
     {{MissCause::database, 950}}},
    {"database, where the wait spins",
     [](RunEvidence& run) {
       run.blocked_ns = 950 * us;
       compute(run, 1'050 * us);
     },
     {{MissCause::database, 950}}},
    {"preempted",
     [](RunEvidence& run) { run.finish_ns = run.start_ns + 1'100 * us; },
     {{MissCause::preempted, 1'000}}},
    {"page fault from disk",
     [](RunEvidence& run) {
       run.finish_ns = run.start_ns + 1'100 * us;
       run.major_faults = 1;
     },
     {{MissCause::page_fault, 1'000}}},
    {"many small page faults",
     [](RunEvidence& run) {
       run.budget_ns = 300 * us;
       compute(run, 1'100 * us);
       run.minor_faults = 700;
     },
     {{MissCause::page_fault, 700}, {MissCause::own_work, 100}}},
    {"host pause in the step",
     [](RunEvidence& run) {
       run.finish_ns = run.start_ns + 50'100 * us;
       run.pause_in_step_ns = 49'000 * us;
     },
     {{MissCause::host_pause, 49'000}, {MissCause::preempted, 1'000}}},
    {"host pause before the step",
     [](RunEvidence& run) {
       delay_start(run, 50'000 * us);
       run.base_wake_ns = run.ready_ns = run.start_ns;
       run.pause_before_start_ns = 49'000 * us;
     },
     {{MissCause::host_pause, 49'000}, {MissCause::late_wake_up, 1'000}}},
    {"pause of the process while the step waits for the database",
     [](RunEvidence& run) {
       run.finish_ns = run.start_ns + 50'100 * us;
       run.blocked_ns = 49'800 * us;
       run.process_pause_in_step_ns = 48'000 * us;
     },
     {{MissCause::host_pause, 48'000}, {MissCause::database, 1'800}}},
    {"pause of the process longer than the wait",
     [](RunEvidence& run) {
       run.finish_ns = run.start_ns + 50'100 * us;
       run.blocked_ns = 49'800 * us;
       run.process_pause_in_step_ns = 60'000 * us;
     },
     {{MissCause::host_pause, 49'800}}},
    {"pause of the process that includes a detected pause",
     [](RunEvidence& run) {
       run.finish_ns = run.start_ns + 50'100 * us;
       run.blocked_ns = 20'000 * us;
       run.pause_in_step_ns = 29'000 * us;
       run.process_pause_in_step_ns = 30'000 * us;
     },
     {{MissCause::host_pause, 30'000}, {MissCause::database, 19'000}}},
    {"waiting for the task's previous run, which waited for the database",
     [](RunEvidence& run) {
       delay_start(run, 950 * us);
       run.ready_ns = run.start_ns;
       run.same_task_until_ns = run.release_ns + 940 * us;
       run.same_task_cause = MissCause::database;
     },
     {{MissCause::database, 940}, {MissCause::earlier_task, 10}}},
};

TEST(MissCause, PartsOfADelayHaveTheirCauses) {
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    RunEvidence run = quiet_run();
    one.change(run);
    const DelayParts parts = attribute_delay(run);
    EXPECT_STREQ(to_string(parts.largest()), to_string(one.parts[0].first));
    for (const auto& [cause, part_us] : one.parts)
      EXPECT_EQ(parts[cause], part_us * us) << to_string(cause);
  }
}

TEST(MissCause, PartsNeverExceedTheResponseTime) {
  std::mt19937_64 random(3);
  const auto up_to = [&](std::int64_t largest) {
    return static_cast<std::int64_t>(random() % (largest + 1));
  };
  for (int i = 0; i < 20'000; ++i) {
    RunEvidence run;
    run.release_ns = 1'000'000;
    run.base_wake_ns = run.release_ns + up_to(1'000) - 500;
    run.ready_ns = run.release_ns + up_to(2'000);
    run.thread_free_ns = run.release_ns + up_to(4'000) - 1'000;
    run.start_ns = run.ready_ns + up_to(2'000);
    run.finish_ns = run.start_ns + up_to(3'000);
    run.deadline_ns = 1 + up_to(2'000);
    run.budget_ns = up_to(500);
    run.cpu_ns = up_to(4'000);
    run.blocked_ns = up_to(4'000);
    run.minor_faults = up_to(3);
    run.major_faults = up_to(1);
    run.pause_before_start_ns = up_to(3'000);
    run.pause_in_step_ns = up_to(3'000);
    run.process_pause_in_step_ns = up_to(4'000);
    run.same_task_until_ns = run.release_ns + up_to(4'000) - 1'000;
    run.same_task_cause = static_cast<MissCause>(up_to(miss_cause_count - 1));
    const DelayParts parts = attribute_delay(run);
    std::int64_t sum = 0;
    for (std::size_t cause = 0; cause < miss_cause_count; ++cause) {
      EXPECT_GE(parts[static_cast<MissCause>(cause)], 0);
      sum += parts[static_cast<MissCause>(cause)];
    }
    ASSERT_LE(sum, run.finish_ns - run.release_ns);
  }
}

TEST(MissCause, EveryCauseHasAName) {
  for (std::size_t cause = 0; cause < miss_cause_count; ++cause) {
    EXPECT_STRNE(to_string(static_cast<MissCause>(cause)), "unknown");
  }
}

}  // namespace
}  // namespace hil::executive
