#include "runtime/run/executive_record.hpp"

#include <algorithm>

namespace hil::run {
namespace {

report::Quantiles quantiles_of(const executive::Histogram& histogram) {
  const executive::Quantiles quantiles = histogram.quantiles();
  return {histogram.count(), quantiles.p50_ns, quantiles.p99_ns, quantiles.p999_ns, quantiles.max_ns};
}

report::Histogram bins_of(const executive::Histogram& histogram) {
  report::Histogram bins;
  for (const auto& bucket : histogram.filled_buckets())
    bins.push_back({bucket.first_ns, bucket.last_ns, bucket.count});
  return bins;
}

report::Task task_of(const executive::TaskResult& result) {
  report::Task task;
  task.name = result.name;
  task.rate_hz = result.rate_hz;
  task.thread = result.thread;
  task.deadline_ns = result.deadline_ns;
  task.overrun_policy = "skip";
  task.runs = result.runs;
  task.warmup_runs = result.warmup_runs;
  task.deadline_misses = result.deadline_misses;
  task.overruns = result.overruns;
  task.skipped = result.skipped;
  task.aborted = result.aborted;
  task.over_budget = result.over_budget;
  task.page_faults = static_cast<std::uint64_t>(result.minor_faults + result.major_faults);
  task.wake_latency_ns = quantiles_of(result.wake_latency);
  task.wall_ns = quantiles_of(result.wall);
  task.cpu_ns = quantiles_of(result.cpu);
  task.blocked_ns = quantiles_of(result.blocked);
  task.gpu_ns = quantiles_of(result.gpu);
  task.slack_ns = {result.wall.count(), result.slack_min_ns, result.slack_p50_ns};
  task.histograms = {bins_of(result.wake_latency), bins_of(result.wall), bins_of(result.cpu),
                     bins_of(result.blocked)};
  task.warmup_problems = result.warmup_problems;
  for (std::size_t i = 0; i < result.misses_by_cause.size(); ++i) {
    if (result.misses_by_cause[i] == 0) continue;
    task.misses_by_cause.push_back(
        {executive::to_string(static_cast<executive::MissCause>(i)), result.misses_by_cause[i]});
  }
  task.worst_lateness_ns = result.worst_lateness_ns;
  for (const executive::Miss& miss : result.misses)
    task.misses.push_back({miss.tick, executive::to_string(miss.cause), miss.lateness_ns});
  return task;
}

report::BaseStage stage(const char* name, const executive::Histogram& histogram) {
  return {name, histogram.total_ns(), quantiles_of(histogram)};
}

const char* policy_name(config::Overrun overrun) {
  switch (overrun) {
    case config::Overrun::skip:
      return "skip";
    case config::Overrun::queue:
      return "queue";
    case config::Overrun::abort:
      return "abort";
  }
  return "";
}

}  // namespace

void take_executive(const executive::RunResult& result, const config::Scenario& scenario,
                    report::RunRecord& record) {
  record.ticks = result.ticks;
  record.skipped_ticks = result.base.skipped_ticks;
  record.run_time_ns = result.run_time_ns;
  record.period_ns = result.period_ns;
  record.realtime.scheduler =
      result.realtime.scheduler == executive::Scheduler::fifo ? "SCHED_FIFO" : "SCHED_OTHER";
  record.realtime.priority = result.realtime.priority;
  record.realtime.locked_memory = result.realtime.memory_locked;
  record.realtime.cpus = result.realtime.cpus;
  record.realtime.degraded = result.realtime.degraded;
  for (const executive::TaskResult& task_result : result.tasks) {
    report::Task task = task_of(task_result);
    const auto section = std::find_if(scenario.tasks.begin(), scenario.tasks.end(),
                                      [&](const auto& s) { return s.module.text == task.name; });
    if (section != scenario.tasks.end()) {
      task.budget_ns = section->budget_ns;
      task.overrun_policy = policy_name(section->overrun);
    }
    record.tasks.push_back(std::move(task));
  }
  record.base_stages = {stage("wake-up latency", result.base.wake), stage("latch inputs", result.base.begin),
                        stage("publish", result.base.publish),      stage("tasks", result.base.tasks),
                        stage("end of tick", result.base.end),      stage("idle", result.base.idle)};
  if (result.hang) {
    record.watchdog.push_back({static_cast<std::int64_t>(result.hang->ticks_begun) * result.period_ns,
                               "the base thread made no tick for " +
                                   std::to_string(result.hang->silent_ns / 1'000'000) +
                                   " ms; outputs were set to their safe values"});
  }
  for (const executive::Skip& skip : result.base.skips) {
    record.watchdog.push_back({static_cast<std::int64_t>(skip.tick) * result.period_ns,
                               std::to_string(skip.count) + (skip.count == 1 ? " tick" : " ticks") +
                                   " skipped (" + executive::to_string(skip.cause) + ")"});
  }
  record.watchdog_not_listed = result.base.times_skipped - result.base.skips.size();
}

report::TraceRecord trace_of(const executive::RunResult& result, const std::vector<report::Event>& events) {
  report::TraceRecord trace;
  trace.process_name = "hil";
  trace.tracks.push_back({"base tick"});
  for (const executive::TaskResult& task : result.tasks)
    trace.tracks.push_back({task.name});
  for (const executive::TickSpan& tick : result.trace.ticks) {
    const auto add = [&](const char* name, std::int64_t from_ns, std::int64_t to_ns) {
      if (to_ns > from_ns) trace.spans.push_back({0, tick.tick, from_ns, to_ns - from_ns, name});
    };
    add("wake-up latency", tick.frame_begin_ns, tick.awake_ns);
    add("latch inputs", tick.awake_ns, tick.begun_ns);
    add("publish", tick.begun_ns, tick.published_ns);
    add("tasks", tick.published_ns, tick.worked_ns);
    add("end of tick", tick.worked_ns, tick.ended_ns);
  }
  for (const executive::TaskSpan& span : result.trace.tasks) {
    trace.spans.push_back({span.task + 1, span.tick, span.start_ns, span.finish_ns - span.start_ns, {}});
    if (span.missed) trace.instants.push_back({span.task + 1, span.finish_ns, "deadline miss"});
  }
  for (const report::Event& event : events) {
    trace.instants.push_back({report::TraceInstant::whole_run, event.time_ns, event.text});
  }
  return trace;
}

}  // namespace hil::run
