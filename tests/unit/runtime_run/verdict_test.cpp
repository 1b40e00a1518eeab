#include "runtime/run/verdict.hpp"

#include <gtest/gtest.h>

#include "runtime/run/fail_on.hpp"

namespace hil::run {
namespace {

using report::ExpectationResult;

class Verdicts : public ::testing::Test {
 protected:
  Verdicts() {
    record_.ticks = 10'000;
    record_.expectations = {{.name = "no collision", .result = ExpectationResult::held, .detail = "held"}};
    record_.tasks.resize(1);
    record_.tasks[0].name = "scanner";
    record_.tasks[0].runs = 100;
  }
  int exit_code(bool interrupted = false, bool gpu_lost = false) {
    decide({.result = result_,
            .gpu_lost = gpu_lost,
            .interrupted = interrupted,
            .max_lost = 0.05,
            .max_hard_misses = max_hard_misses_,
            .fail_on = fail_on_},
           record_);
    return record_.exit_code;
  }

  executive::RunResult result_;
  std::optional<FailOn> fail_on_;
  std::optional<std::uint64_t> max_hard_misses_;
  report::RunRecord record_;
};

TEST_F(Verdicts, HeldExpectationsPass) {
  EXPECT_EQ(exit_code(), exit_passed);
  EXPECT_EQ(record_.verdict, report::Verdict::passed);
}

TEST_F(Verdicts, UncheckedExpectationFailsAndIsNamed) {
  record_.expectations.push_back(
      {.name = "lights", .result = ExpectationResult::not_checked, .detail = "evaluated on 1 of 9 ticks"});
  EXPECT_EQ(exit_code(), exit_expectation_failed);
  EXPECT_EQ(record_.verdict, report::Verdict::failed);
  EXPECT_EQ(record_.reason, "expectation 'lights' was not checked: evaluated on 1 of 9 ticks");
  record_.expectations.push_back({.name = "speed", .result = ExpectationResult::failed, .detail = "broken"});
  EXPECT_EQ(exit_code(), exit_expectation_failed);
  EXPECT_EQ(record_.reason, "expectation 'speed' failed: broken")
      << "a failure precedes an unchecked expectation";
}

TEST_F(Verdicts, SkippedTicksAboveTheLimitBreakTheTiming) {
  record_.ticks = 9'500;
  record_.skipped_ticks = 500;
  EXPECT_EQ(exit_code(), exit_passed);
  record_.ticks = 9'499;
  record_.skipped_ticks = 501;
  EXPECT_EQ(exit_code(), exit_timing_broken);
  EXPECT_NE(record_.reason.find("501 of 10000 ticks skipped"), std::string::npos) << record_.reason;
  EXPECT_NE(record_.reason.find("the limit (realtime.max_lost) is 5 %"), std::string::npos) << record_.reason;
}

TEST_F(Verdicts, SkippedAndAbortedReleasesBreakTheTiming) {
  report::Task& task = record_.tasks[0];
  task.runs = 95;
  task.skipped = 5;
  EXPECT_EQ(exit_code(), exit_passed);
  task.aborted = 1;
  EXPECT_EQ(exit_code(), exit_timing_broken);
  EXPECT_NE(record_.reason.find("task scanner: 5 of 100 releases skipped, 1 aborted"), std::string::npos)
      << record_.reason;
}

TEST_F(Verdicts, RunsWithoutAResultBreakTheTiming) {
  record_.tasks[0].without_result = 6;
  EXPECT_EQ(exit_code(), exit_timing_broken);
  EXPECT_NE(record_.reason.find("6 of 100 runs had no result"), std::string::npos) << record_.reason;
}

TEST_F(Verdicts, HardMissesBreakTheTiming) {
  report::Task& task = record_.tasks[0];
  task.warmup_runs = 20;
  task.hard_misses = 6;
  task.worst_hard_miss = {.tick = 512, .cause = "own work", .lateness_ns = 400'000};
  EXPECT_EQ(exit_code(), exit_passed) << "6 of 120";
  max_hard_misses_ = 6;
  EXPECT_EQ(exit_code(), exit_passed);
  max_hard_misses_ = 5;
  EXPECT_EQ(exit_code(), exit_timing_broken);
  EXPECT_EQ(record_.reason,
            "task scanner: 6 of 120 runs had a hard transaction after its deadline, at most 400 us late, in "
            "tick 512: own work; the limit (realtime.max_hard_misses) is 5");
  max_hard_misses_.reset();
  task.hard_misses = 7;
  EXPECT_EQ(exit_code(), exit_timing_broken);
  EXPECT_NE(record_.reason.find("7 of 120 runs"), std::string::npos) << record_.reason;
  EXPECT_NE(record_.reason.find("realtime.max_lost"), std::string::npos) << record_.reason;
}

TEST_F(Verdicts, OutputsThatWereNotSentBreakTheTiming) {
  record_.tasks[0].name = "can.car";
  const auto set_dropped = [&](std::uint64_t ticks) {
    const report::BusRecord car{.name = "car", .dropped_releases = ticks};
    record_.buses = {{.list_key = "can", .buses = {car}}};
  };
  set_dropped(5);
  EXPECT_EQ(exit_code(), exit_passed);
  set_dropped(6);
  EXPECT_EQ(exit_code(), exit_timing_broken);
  EXPECT_NE(record_.reason.find("task can.car: the outputs of 6 of 100 runs were not sent"),
            std::string::npos)
      << record_.reason;
}

TEST_F(Verdicts, MostSevereReasonDecides) {
  record_.expectations[0].result = ExpectationResult::failed;
  EXPECT_EQ(exit_code(), exit_expectation_failed);
  EXPECT_EQ(exit_code(true), exit_interrupted);
  config::Diagnostics diagnostics;
  fail_on_ = parse_fail_on("skipped > 0", diagnostics);
  ASSERT_TRUE(fail_on_) << diagnostics.to_text();
  result_.tasks.resize(1);
  result_.tasks[0].skipped = 1;
  EXPECT_EQ(exit_code(true), exit_timing_broken);
  EXPECT_EQ(record_.reason, "the condition of --fail-on holds: skipped > 0");
  record_.skipped_ticks = 10'000;
  EXPECT_EQ(exit_code(true), exit_timing_broken);
  EXPECT_NE(record_.reason.find("realtime.max_lost"), std::string::npos) << record_.reason;
  result_.hang.emplace();
  record_.watchdog = {{.text = "the base thread completed no tick"}};
  EXPECT_EQ(exit_code(true), exit_timing_broken);
  EXPECT_EQ(record_.reason, "the base thread completed no tick");
  record_.failures = {"Modbus unit plc was lost", "signals.csv could not be written whole"};
  EXPECT_EQ(exit_code(true), exit_io_failed);
  EXPECT_EQ(record_.reason, "Modbus unit plc was lost");
  EXPECT_EQ(exit_code(true, true), exit_gpu_failed);
}

}  // namespace
}  // namespace hil::run
