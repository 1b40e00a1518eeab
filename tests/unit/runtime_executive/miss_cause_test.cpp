#include "runtime/executive/miss_cause.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hil::executive {
namespace {

constexpr std::int64_t us = 1'000;

/// A run of 1 ms deadline that began at once and computed 100 us.
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

void delay_start(RunEvidence& run, std::int64_t by_ns) {
  run.start_ns += by_ns;
  run.finish_ns += by_ns;
}

TEST(MissCause, LateWakeupOfTheBaseThread) {
  RunEvidence run = quiet_run();
  delay_start(run, 950 * us);
  run.base_wake_ns += 950 * us;
  run.ready_ns = run.start_ns;
  EXPECT_EQ(take_apart(run).largest(), MissCause::late_wakeup);
  EXPECT_EQ(take_apart(run)[MissCause::late_wakeup], 950 * us);
}

TEST(MissCause, LateWakeupOfTheTasksOwnThread) {
  RunEvidence run = quiet_run();
  delay_start(run, 950 * us);
  run.ready_ns = run.release_ns + 5 * us;
  const DelayParts parts = take_apart(run);
  EXPECT_EQ(parts[MissCause::late_wakeup], 945 * us);
  EXPECT_EQ(parts[MissCause::earlier_task], 5 * us);
}

TEST(MissCause, EarlierTaskOnTheBaseThread) {
  RunEvidence run = quiet_run();
  delay_start(run, 950 * us);
  run.base_wake_ns += 20 * us;
  run.ready_ns = run.start_ns;
  const DelayParts parts = take_apart(run);
  EXPECT_EQ(parts.largest(), MissCause::earlier_task);
  EXPECT_EQ(parts[MissCause::earlier_task], 930 * us);
  EXPECT_EQ(parts[MissCause::late_wakeup], 20 * us);
}

TEST(MissCause, EarlierTaskOnASharedThread) {
  RunEvidence run = quiet_run();
  delay_start(run, 950 * us);
  run.thread_free_ns = run.release_ns + 940 * us;
  const DelayParts parts = take_apart(run);
  EXPECT_EQ(parts[MissCause::earlier_task], 940 * us);
  EXPECT_EQ(parts[MissCause::late_wakeup], 10 * us);
}

TEST(MissCause, OwnWorkCountsAboveTheBudget) {
  RunEvidence run = quiet_run();
  run.budget_ns = 500 * us;
  delay_start(run, 300 * us);
  run.base_wake_ns = run.ready_ns = run.start_ns;
  run.cpu_ns = 900 * us;
  run.finish_ns = run.start_ns + 900 * us;
  EXPECT_EQ(take_apart(run)[MissCause::own_work], 400 * us);
  EXPECT_EQ(take_apart(run).largest(), MissCause::own_work);
  run.budget_ns = 800 * us;
  EXPECT_EQ(take_apart(run).largest(), MissCause::late_wakeup)
      << "100 us over budget against 300 us of waiting";
}

TEST(MissCause, WithoutABudgetTheDeadlineIsTheAllowance) {
  RunEvidence run = quiet_run();
  run.cpu_ns = 1'200 * us;
  run.finish_ns = run.start_ns + 1'200 * us;
  EXPECT_EQ(take_apart(run)[MissCause::own_work], 200 * us);
  EXPECT_EQ(take_apart(run).largest(), MissCause::own_work);
}

TEST(MissCause, Database) {
  RunEvidence run = quiet_run();
  run.blocked_ns = 950 * us;
  run.finish_ns = run.start_ns + 1'050 * us;
  EXPECT_EQ(take_apart(run).largest(), MissCause::database);
  run.cpu_ns = 1'040 * us;  // the wait was spinning
  EXPECT_EQ(take_apart(run).largest(), MissCause::database);
}

TEST(MissCause, Preempted) {
  RunEvidence run = quiet_run();
  run.finish_ns = run.start_ns + 1'100 * us;
  EXPECT_EQ(take_apart(run).largest(), MissCause::preempted);
  EXPECT_EQ(take_apart(run)[MissCause::preempted], 1'000 * us);
}

TEST(MissCause, PageFaultsFromDiskTakeTheTimeOffTheCpu) {
  RunEvidence run = quiet_run();
  run.finish_ns = run.start_ns + 1'100 * us;
  run.major_faults = 1;
  EXPECT_EQ(take_apart(run).largest(), MissCause::page_fault);
}

TEST(MissCause, ManySmallPageFaultsAreNotTheTasksWork) {
  RunEvidence run = quiet_run();
  run.budget_ns = 300 * us;
  run.cpu_ns = 1'100 * us;
  run.finish_ns = run.start_ns + 1'100 * us;
  run.minor_faults = 700;
  const DelayParts parts = take_apart(run);
  EXPECT_EQ(parts[MissCause::page_fault], 700 * us);
  EXPECT_EQ(parts[MissCause::own_work], 100 * us);
  EXPECT_EQ(parts.largest(), MissCause::page_fault);
}

TEST(MissCause, HostPauseInTheStepAndBeforeIt) {
  RunEvidence run = quiet_run();
  run.finish_ns = run.start_ns + 50'100 * us;
  run.pause_in_step_ns = 49'000 * us;
  EXPECT_EQ(take_apart(run).largest(), MissCause::host_pause);

  run = quiet_run();
  delay_start(run, 50'000 * us);
  run.base_wake_ns = run.ready_ns = run.start_ns;
  run.pause_before_start_ns = 49'000 * us;
  const DelayParts parts = take_apart(run);
  EXPECT_EQ(parts[MissCause::host_pause], 49'000 * us);
  EXPECT_EQ(parts[MissCause::late_wakeup], 1'000 * us);
}

TEST(MissCause, AWaitForTheDatabaseInWhichNoThreadRanIsAPause) {
  RunEvidence run = quiet_run();
  run.finish_ns = run.start_ns + 50'100 * us;
  run.blocked_ns = 49'800 * us;
  EXPECT_EQ(take_apart(run).largest(), MissCause::database);
  run.standstill_in_step_ns = 48'000 * us;
  DelayParts parts = take_apart(run);
  EXPECT_EQ(parts[MissCause::host_pause], 48'000 * us);
  EXPECT_EQ(parts[MissCause::database], 1'800 * us);
  run.standstill_in_step_ns = 60'000 * us;
  EXPECT_EQ(take_apart(run)[MissCause::host_pause], 49'800 * us) << "no more than it waited";
  // What was found already is not counted twice.
  run.blocked_ns = 20'000 * us;
  run.pause_in_step_ns = 29'000 * us;
  run.standstill_in_step_ns = 30'000 * us;
  parts = take_apart(run);
  EXPECT_EQ(parts[MissCause::host_pause], 30'000 * us);
  EXPECT_EQ(parts[MissCause::database], 19'000 * us);
}

TEST(MissCause, WaitingForItsOwnRunBeforeInheritsThatRunsCause) {
  RunEvidence run = quiet_run();
  delay_start(run, 950 * us);
  run.ready_ns = run.start_ns;
  run.same_task_until_ns = run.release_ns + 940 * us;
  run.same_task_cause = MissCause::database;
  const DelayParts parts = take_apart(run);
  EXPECT_EQ(parts[MissCause::database], 940 * us);
  EXPECT_EQ(parts[MissCause::earlier_task], 10 * us);
}

TEST(MissCause, PartsNeverExceedTheResponseTime) {
  std::mt19937_64 random(3);
  const auto up_to = [&](std::int64_t most) { return static_cast<std::int64_t>(random() % (most + 1)); };
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
    run.standstill_in_step_ns = up_to(4'000);
    run.same_task_until_ns = run.release_ns + up_to(4'000) - 1'000;
    run.same_task_cause = static_cast<MissCause>(up_to(miss_cause_count - 1));
    const DelayParts parts = take_apart(run);
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
