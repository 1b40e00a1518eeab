#include "runtime/run/verdict.hpp"

#include <algorithm>
#include <utility>

#include "runtime/report/quantities.hpp"
#include "runtime/report/report_text.hpp"
#include "runtime/run/fail_on.hpp"

namespace hil::run {
namespace {

std::string with_limit(const std::string& sentence, double max_lost) {
  return report::to_ascii(sentence + "; the limit (realtime.max_lost) is " +
                          report::shortest(max_lost * 100.0) + " %");
}

bool exceeds(std::uint64_t part, std::uint64_t whole, double max_lost) {
  return whole > 0 && static_cast<double>(part) > max_lost * static_cast<double>(whole);
}

const report::Expectation* first_with(const report::RunRecord& record, report::ExpectationResult result) {
  for (const report::Expectation& expectation : record.expectations) {
    if (expectation.result == result) return &expectation;
  }
  return nullptr;
}

/// A sentence for the first share of ticks, releases or unsent outputs above `max_lost`; empty: there is
/// none.
std::string lost_beyond_limit(const report::RunRecord& record, double max_lost) {
  if (exceeds(record.skipped_ticks, record.ticks + record.skipped_ticks, max_lost))
    return with_limit(report::skipped_ticks_sentence(record), max_lost);
  for (const report::Task& task : record.tasks) {
    if (exceeds(task.skipped + task.aborted, task.runs + task.skipped, max_lost))
      return with_limit(report::lost_releases_sentence(task), max_lost);
    if (exceeds(task.without_result, task.runs + task.warmup_runs, max_lost)) {
      return with_limit("task " + task.name + ": " + std::to_string(task.without_result) + " of " +
                            report::counted(task.runs + task.warmup_runs, "run", "runs") +
                            " had no result of the database",
                        max_lost);
    }
    if (exceeds(task.hard_misses, task.runs + task.warmup_runs, max_lost))
      return with_limit(report::hard_misses_sentence(task), max_lost);
  }
  for (const report::BusGroup& group : record.buses) {
    for (const report::BusRecord& bus : group.buses) {
      const std::string task_name = group.list_key + "." + bus.name;
      const std::uint64_t dropped = bus.dropped_releases.value_or(0);
      const auto task = std::ranges::find(record.tasks, task_name, &report::Task::name);
      if (task == record.tasks.end() || !exceeds(dropped, task->runs, max_lost)) continue;
      return with_limit("task " + task_name + ": the outputs of " + std::to_string(dropped) + " of " +
                            report::counted(task->runs, "run", "runs") +
                            " were not sent: its thread was too slow",
                        max_lost);
    }
  }
  return {};
}

/// A sentence on the hard transactions that were late, if they are more than permitted; else empty.
std::string hard_misses_beyond(const report::RunRecord& record, std::uint64_t max_hard_misses) {
  std::uint64_t all = 0;
  const report::Task* first = nullptr;
  for (const report::Task& task : record.tasks) {
    all += task.hard_misses;
    if (first == nullptr && task.hard_misses > 0) first = &task;
  }
  if (all <= max_hard_misses) return {};
  return report::to_ascii(report::hard_misses_sentence(*first)) +
         "; the limit (realtime.max_hard_misses) is " + std::to_string(max_hard_misses);
}

}  // namespace

void decide(const VerdictInputs& inputs, report::RunRecord& record) {
  const auto conclude = [&](report::Verdict verdict, int exit_code, std::string reason) {
    record.verdict = verdict;
    record.exit_code = exit_code;
    record.reason = std::move(reason);
  };
  if (inputs.gpu_lost)
    return conclude(report::Verdict::gpu_failed, exit_gpu_failed, "the GPU stopped answering");
  if (!record.failures.empty())
    return conclude(report::Verdict::io_failed, exit_io_failed, record.failures.front());
  if (inputs.result.hang) {
    return conclude(report::Verdict::timing_broken, exit_timing_broken, record.watchdog.front().text);
  }
  if (const std::string lost = lost_beyond_limit(record, inputs.max_lost); !lost.empty())
    return conclude(report::Verdict::timing_broken, exit_timing_broken, lost);
  if (inputs.max_hard_misses) {
    if (const std::string late = hard_misses_beyond(record, *inputs.max_hard_misses); !late.empty())
      return conclude(report::Verdict::timing_broken, exit_timing_broken, late);
  }
  if (inputs.fail_on && timing_broken(*inputs.fail_on, inputs.result, record)) {
    return conclude(report::Verdict::timing_broken, exit_timing_broken,
                    "the condition of --fail-on holds: " + inputs.fail_on->text);
  }
  if (inputs.interrupted) {
    return conclude(report::Verdict::interrupted, exit_interrupted,
                    "stopped after " + report::counted(record.ticks, "tick", "ticks"));
  }
  if (const report::Expectation* failed = first_with(record, report::ExpectationResult::failed)) {
    return conclude(report::Verdict::failed, exit_expectation_failed,
                    "expectation '" + failed->name + "' failed: " + failed->detail);
  }
  if (!record.input_failures.empty())
    return conclude(report::Verdict::failed, exit_expectation_failed, record.input_failures.front());
  if (const report::Expectation* unknown = first_with(record, report::ExpectationResult::not_checked)) {
    return conclude(report::Verdict::failed, exit_expectation_failed,
                    "expectation '" + unknown->name + "' was not checked: " + unknown->detail);
  }
  if (const auto unchecked = report::sentences_of_unchecked_injections(record); !unchecked.empty())
    return conclude(report::Verdict::failed, exit_expectation_failed, unchecked.front());
  if (record.expectations.empty())
    return conclude(report::Verdict::completed, exit_passed,
                    "nothing was checked: the scenario has no expectations");
  conclude(report::Verdict::passed, exit_passed, "every expectation held");
}

}  // namespace hil::run
