#include "runtime/executive/accounting.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>

namespace hil::executive {
namespace {

constexpr std::int64_t look_period_ns = 2'000'000;
constexpr int looks_per_steal = 10;

std::size_t runs_in(std::int64_t span_ns, const Accounting::Slots& slots) {
  std::size_t runs = 0;
  for (const auto& slot : slots)
    runs += static_cast<std::size_t>(span_ns / slot->period_ns) + (span_ns > 0 ? 1 : 0);
  return runs;
}

std::size_t ticks_in(std::int64_t span_ns, std::int64_t base_period_ns) {
  return static_cast<std::size_t>(span_ns / base_period_ns) + (span_ns > 0 ? 1 : 0);
}

}  // namespace

Accounting::Accounting(const AccountingOptions& options, const Slots& slots, std::int64_t base_period_ns,
                       const Probe& probe)
    : base_runs_(options.records_per_thread),
      base_ticks_(options.records_per_thread),
      probe_(probe),
      options_(options),
      rings_{&base_runs_},
      last_runs_(runs_in(options.trace_ns, slots)),
      last_ticks_(ticks_in(options.trace_ns, base_period_ns)) {
  for (const auto& slot : slots)
    tasks_.emplace_back(*slot, base_period_ns, options.max_misses_per_task);
  base_.skips.reserve(options.max_misses_per_task);
}

Accounting::~Accounting() {
  finish();
}

void Accounting::start() {
  thread_ = std::thread([this] { serve(); });
}

void Accounting::finish() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  drain();
}

void Accounting::serve() {
  pthread_setname_np(pthread_self(), "hil-accounting");
  look_at_steal();
  std::unique_lock lock(mutex_);
  for (int look = 1;; ++look) {
    const std::int64_t wake_ns = probe_.host_now_ns() + look_period_ns;
    const std::int64_t ran_before_ns = probe_.process_cpu_ns();
    if (wake_.wait_for(lock, std::chrono::nanoseconds(look_period_ns), [this] { return stopping_; })) return;
    pause_detector_.note_sleep(wake_ns, probe_.host_now_ns(), probe_.process_cpu_ns() - ran_before_ns);
    if (look % looks_per_steal == 0) look_at_steal();
    drain();
  }
}

void Accounting::look_at_steal() {
  pause_detector_.note_steal(probe_.host_now_ns(), probe_.host_steal_ns());
}

void Accounting::drain() {
  steal_is_fresh_ = false;
  base_ticks_.drain([this](const TickRecord& tick) { take_tick(tick); });
  for (SpscRing<RunRecord>* ring : rings_) {
    ring->drain([this](const RunRecord& run) { take_run(run); });
  }
}

void Accounting::take_run(const RunRecord& run) {
  TaskAccount& task = tasks_[run.task];
  if (task.is_late(run) && !steal_is_fresh_) {
    look_at_steal();
    steal_is_fresh_ = true;
  }
  task.take(run, pause_detector_);
  last_runs_.put(run);
}

void Accounting::take_tick(const TickRecord& tick) {
  base_.wake.record(tick.awake_ns - tick.frame_begin_ns);
  base_.begin.record(tick.begun_ns - tick.awake_ns);
  base_.publish.record(tick.published_ns - tick.begun_ns);
  base_.tasks.record(tick.worked_ns - tick.published_ns);
  base_.end.record(tick.ended_ns - tick.worked_ns);
  base_.idle.record(tick.frame_end_ns() - tick.ended_ns);
  if (tick.base_wake_ns < tick.frame_begin_ns) ++base_.late_ticks;
  if (tick.skipped_before > 0) {
    base_.skipped_ticks += tick.skipped_before;
    if (base_.skips.size() < options_.max_misses_per_task) {
      base_.skips.push_back({tick.tick - tick.skipped_before, tick.skipped_before, cause_of_skip(tick)});
    }
  }
  last_tick_ = tick;
  last_ticks_.put(tick);
}

MissCause Accounting::cause_of_skip(const TickRecord& tick) const noexcept {
  const bool slept = tick.base_wake_ns >= tick.frame_begin_ns;
  const std::int64_t begin_ns = slept ? tick.frame_begin_ns : last_tick_.awake_ns;
  const std::int64_t lost_ns = tick.awake_ns - begin_ns;
  if (pause_detector_.pause_ns(begin_ns, tick.awake_ns, lost_ns) * 2 >= lost_ns) return MissCause::host_pause;
  return slept ? MissCause::late_wake_up : MissCause::earlier_task;
}

void Accounting::write_into(RunResult& result, const Slots& slots, std::int64_t start_ns) const {
  for (const auto& slot : slots)
    result.tasks.push_back(tasks_[slot->index].result(*slot));
  result.base = base_;
  for (const SpscRing<RunRecord>* ring : rings_)
    result.lost_records += ring->lost();
  result.lost_records += base_ticks_.lost();

  const std::int64_t oldest_ns = result.run_time_ns - options_.trace_ns;
  for (const RunRecord& run : last_runs_.in_order()) {
    if (run.not_started || run.start_ns - start_ns < oldest_ns) continue;
    result.trace.tasks.push_back({run.task, tasks_[run.task].is_late(run) && !run.warmup, run.tick,
                                  run.start_ns - start_ns, run.finish_ns - start_ns, run.cpu_ns,
                                  run.blocked_ns});
  }
  std::stable_sort(
      result.trace.tasks.begin(), result.trace.tasks.end(),
      [](const TaskSpan& left, const TaskSpan& right) { return left.start_ns < right.start_ns; });
  for (const TickRecord& tick : last_ticks_.in_order()) {
    if (tick.frame_begin_ns - start_ns < oldest_ns) continue;
    result.trace.ticks.push_back({tick.tick, tick.frame_begin_ns - start_ns, tick.awake_ns - start_ns,
                                  tick.begun_ns - start_ns, tick.published_ns - start_ns,
                                  tick.worked_ns - start_ns, tick.ended_ns - start_ns,
                                  tick.frame_end_ns() - start_ns});
  }
}

}  // namespace hil::executive
