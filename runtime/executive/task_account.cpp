#include "runtime/executive/task_account.hpp"

#include <algorithm>

namespace hil::executive {

TaskAccount::TaskAccount(const TaskSlot& slot, std::int64_t base_period_ns, std::size_t max_misses)
    : budget_ns_(slot.spec.budget_ns), max_misses_(max_misses) {
  result_.name = slot.spec.name;
  result_.thread = slot.spec.thread;
  result_.period_ns = base_period_ns * slot.spec.every_ticks;
  result_.rate_hz = 1e9 / static_cast<double>(result_.period_ns);
  result_.deadline_ns = slot.deadline_ns;
  result_.misses.reserve(max_misses);
}

void TaskAccount::take(const RunRecord& run, const HostPauseDetector& pause_detector) {
  if (is_late(run)) {
    const DelayParts parts = explain(run, pause_detector);
    last_cause_ = parts.largest();
    if (!run.warmup) note_miss(run, parts);
  }
  last_finish_ns_ = run.finish_ns;
  if (!run.warmup && !run.not_started) measure(run);
}

void TaskAccount::note_miss(const RunRecord& run, const DelayParts& parts) {
  const std::int64_t lateness_ns = run.finish_ns - run.release_ns - result_.deadline_ns;
  ++result_.misses_by_cause[static_cast<std::size_t>(last_cause_)];
  result_.worst_lateness_ns = std::max(result_.worst_lateness_ns, lateness_ns);
  if (result_.misses.size() < max_misses_)
    result_.misses.push_back({run.tick, last_cause_, lateness_ns, parts});
}

DelayParts TaskAccount::explain(const RunRecord& run,
                                const HostPauseDetector& pause_detector) const noexcept {
  RunEvidence evidence;
  evidence.release_ns = run.release_ns;
  evidence.base_wake_ns = run.base_wake_ns;
  evidence.ready_ns = run.ready_ns;
  evidence.thread_free_ns = run.thread_free_ns;
  evidence.start_ns = run.start_ns;
  evidence.finish_ns = run.finish_ns;
  evidence.deadline_ns = result_.deadline_ns;
  evidence.budget_ns = budget_ns_;
  evidence.cpu_ns = run.cpu_ns;
  evidence.blocked_ns = run.blocked_ns;
  evidence.minor_faults = run.minor_faults;
  evidence.major_faults = run.major_faults;
  evidence.pause_before_start_ns =
      pause_detector.pause_ns(run.release_ns, run.start_ns, run.start_ns - run.release_ns);
  const std::int64_t off_cpu_ns = run.finish_ns - run.start_ns - run.cpu_ns - run.blocked_ns;
  evidence.pause_in_step_ns = pause_detector.pause_ns(run.start_ns, run.finish_ns, off_cpu_ns);
  evidence.process_pause_in_step_ns = pause_detector.process_pause_ns(run.start_ns, run.finish_ns);
  evidence.same_task_until_ns = last_finish_ns_;
  evidence.same_task_cause = last_cause_;
  return attribute_delay(evidence);
}

void TaskAccount::measure(const RunRecord& run) noexcept {
  result_.wake_latency.record(run.start_ns - run.release_ns);
  result_.wall.record(run.finish_ns - run.start_ns);
  result_.cpu.record(run.cpu_ns);
  result_.blocked.record(run.blocked_ns);
  result_.gpu.record(run.gpu_ns);
  result_.response.record(run.finish_ns - run.release_ns);
  result_.minor_faults += run.minor_faults;
  result_.major_faults += run.major_faults;
}

TaskResult TaskAccount::result(const TaskSlot& slot) const {
  TaskResult result = result_;
  const TaskCounters& counted = slot.counters;
  result.runs = counted.runs.get();
  result.warmup_runs = counted.warmup_runs.get();
  result.deadline_misses = counted.deadline_misses.get();
  result.overruns = counted.overruns.get();
  result.skipped = counted.skipped.get();
  result.aborted = counted.aborted.get();
  result.over_budget = counted.over_budget.get();
  result.warmup_problems = counted.warmup_problems.get();
  if (result.response.count() > 0) {
    result.slack_min_ns = result.deadline_ns - result.response.max_ns();
    result.slack_p50_ns = result.deadline_ns - result.response.quantile_ns(0.5);
  }
  return result;
}

}  // namespace hil::executive
