#include "runtime/executive/base_loop.hpp"

#include <algorithm>
#include <utility>

namespace hil::executive {

BaseLoop::BaseLoop(const ExecutiveOptions& options, const Probe& probe, const Accounting::Slots& slots,
                   std::vector<Worker*> worker_of, Accounting& accounting, BaseBeat& beat)
    : options_(options),
      clock_(*options.clock),
      probe_(probe),
      hooks_(*options.hooks),
      slots_(slots),
      worker_of_(std::move(worker_of)),
      accounting_(accounting),
      beat_(beat) {}

bool BaseLoop::run(const std::atomic<bool>& stop_requested) noexcept {
  start_ns_ = clock_.now_ns() + (clock_.is_virtual() ? 0 : options_.base_period_ns);
  base_wake_ns_ = start_ns_;
  ended_ns_ = start_ns_;
  hooks_.before_first_tick(start_ns_);
  while (options_.duration_ticks == 0 || next_tick_ < options_.duration_ticks) {
    if (!wait_for_tick(stop_requested)) return true;
    const std::uint64_t skipped = skip_late_ticks();
    next_tick_ += skipped;
    run_tick(skipped);
    ++next_tick_;
  }
  return false;
}

bool BaseLoop::wait_for_tick(const std::atomic<bool>& stop_requested) noexcept {
  const std::int64_t target_ns = due_ns(next_tick_);
  frame_begin_ns_ = std::max(target_ns, ended_ns_);
  awake_ns_ = clock_.now_ns();
  const bool sleeps = awake_ns_ < target_ns;
  while (awake_ns_ < target_ns) {
    if (stop_requested.load(std::memory_order_relaxed)) return false;
    clock_.sleep_until(target_ns);
    awake_ns_ = clock_.now_ns();
  }
  if (sleeps) base_wake_ns_ = awake_ns_;
  return !stop_requested.load(std::memory_order_relaxed);
}

std::uint64_t BaseLoop::skip_late_ticks() noexcept {
  const auto latest_due = static_cast<std::uint64_t>((awake_ns_ - start_ns_) / options_.base_period_ns);
  if (latest_due <= next_tick_ + options_.catch_up_ticks) return 0;
  // The last tick of the run always runs, however late.
  const std::uint64_t resume =
      options_.duration_ticks == 0 ? latest_due : std::min(latest_due, options_.duration_ticks - 1);
  for (const auto& slot : slots_) {
    const std::uint64_t releases = slot->releases_before(resume) - slot->releases_before(next_tick_);
    if (releases == 0) continue;
    slot->counters.count_event(slot->counters.skipped, slot->in_warmup(), releases);
    const Phase phase = slot->phase.load(std::memory_order_acquire);
    if (phase == Phase::released || phase == Phase::running) note_overrun(*slot);
  }
  beat_.skipped_ticks.add(resume - next_tick_);
  if (resume > next_tick_) beat_.skips.add(1);
  return resume - next_tick_;
}

void BaseLoop::run_tick(std::uint64_t skipped_before) noexcept {
  const std::uint64_t ticks_before = beat_.ticks_begun.load(std::memory_order_relaxed);
  const std::int64_t run_time_ns = due_ns(next_tick_) - start_ns_;
  beat_.run_time_ns.set(run_time_ns);
  beat_.ticks_begun.store(ticks_before + 1, std::memory_order_release);

  const TickInfo info{next_tick_, run_time_ns, options_.base_period_ns, ticks_before};
  TickRecord record;
  record.tick = next_tick_;
  record.skipped_before = skipped_before;
  record.frame_begin_ns = frame_begin_ns_;
  record.base_wake_ns = base_wake_ns_;
  record.awake_ns = awake_ns_;
  record.next_ns = due_ns(next_tick_ + 1);
  hooks_.begin_tick(info);
  record.begun_ns = clock_.now_ns();
  for (const auto& slot : slots_)
    account(*slot, next_tick_);
  record.published_ns = clock_.now_ns();
  run_tasks(next_tick_);
  record.worked_ns = clock_.now_ns();
  hooks_.end_tick(info);
  record.ended_ns = clock_.now_ns();
  ended_ns_ = record.ended_ns;
  if (clock_.is_virtual() && accounting_.base_ticks().half_full()) accounting_.drain();
  accounting_.base_ticks().push(record);
}

void BaseLoop::run_tasks(std::uint64_t tick) noexcept {
  last_usage_is_valid_ = false;
  for (const auto& slot : slots_) {
    if (!slot->on_base_thread()) {
      release(*slot, tick);
    } else if (slot->released_at(tick)) {
      run_here(*slot, tick);
    }
  }
}

/// Whether a release of a task of the base thread runs. Only releases that came while the task itself was
/// running are dropped; a tick that is late for another reason runs the task late.
bool BaseLoop::admits(TaskSlot& slot, std::int64_t release_ns) noexcept {
  if (release_ns < slot.dropped_until_ns) return false;
  const bool came_while_running = slot.last_start_ns < release_ns && release_ns < slot.last_finish_ns;
  if (!came_while_running) return true;
  if (slot.spec.overrun != OverrunPolicy::queue) return false;
  slot.dropped_until_ns = slot.last_finish_ns;  // keeps this one and drops the others of that time
  return true;
}

void BaseLoop::run_here(TaskSlot& slot, std::uint64_t tick) noexcept {
  if (!admits(slot, due_ns(tick))) {
    slot.counters.count_event(slot.counters.skipped, slot.in_warmup());
    return;
  }
  const TickInfo info = next_run_of(slot, tick);
  RunRecord record = new_record(slot, info);
  if (!last_usage_is_valid_) last_usage_ = read_thread_usage(probe_);
  const ThreadUsage before = last_usage_;
  record.start_ns = clock_.now_ns();
  record.ready_ns = record.start_ns;
  slot.task.latch(info);
  slot.task.step(info);
  const std::int64_t added_ns = slot.task.added_ns();
  if (clock_.is_virtual()) {
    clock_.sleep_until(clock_.now_ns() + added_ns);
  } else if (added_ns > 0) {
    spend(added_ns, clock_);
  }
  slot.task.publish(info);
  record.finish_ns = clock_.now_ns();
  // One reading serves as the end of this run and the beginning of the next.
  last_usage_ = read_thread_usage(probe_);
  last_usage_is_valid_ = true;
  record_usage(record, before, last_usage_);
  if (clock_.is_virtual()) record.cpu_ns += added_ns;
  record.blocked_ns = slot.task.last_blocked_ns();
  record.gpu_ns = slot.task.last_gpu_ns();
  slot.last_start_ns = record.start_ns;
  slot.last_finish_ns = record.finish_ns;
  if (next_release_after_ns(slot, record.start_ns) < record.finish_ns) {
    slot.counters.count_event(slot.counters.overruns, record.warmup);
  }
  count_run(slot, record, false);
  push_record(record);
}

void BaseLoop::release(TaskSlot& slot, std::uint64_t tick) noexcept {
  if (slot.release_queued && slot.phase.load(std::memory_order_acquire) == Phase::idle) {
    slot.release_queued = false;
    begin_run(slot, slot.queued_tick);
  }
  if (!slot.released_at(tick)) return;
  if (slot.phase.load(std::memory_order_acquire) == Phase::idle) {
    begin_run(slot, tick);
    return;
  }
  note_overrun(slot);
  if (slot.spec.overrun == OverrunPolicy::queue && !slot.release_queued) {
    slot.release_queued = true;
    slot.queued_tick = tick;
    slot.task.queue({tick, due_ns(tick) - start_ns_, slot.period_ns, slot.next_run});
  } else {
    slot.counters.count_event(slot.counters.skipped, slot.in_warmup());
  }
}

void BaseLoop::begin_run(TaskSlot& slot, std::uint64_t tick) noexcept {
  slot.info = next_run_of(slot, tick);
  slot.record = new_record(slot, slot.info);
  slot.deadline_tick = tick + slot.deadline_ticks;
  slot.abort_requested = false;
  slot.miss_counted = false;
  slot.overrun_counted = false;
  slot.task.latch(slot.info);
  last_usage_is_valid_ = false;
  slot.record.ready_ns = clock_.now_ns();
  if (Worker* worker = worker_of_[slot.index]; worker != nullptr) {
    slot.phase.store(Phase::released, std::memory_order_release);
    worker->wake();
    return;
  }
  run_step(slot, clock_, probe_);
  push_record(slot.record);
  slot.phase.store(Phase::finished, std::memory_order_relaxed);
}

/// For a task on another thread, at or after its deadline tick: publishes the finished run, or applies the
/// overrun policy.
void BaseLoop::account(TaskSlot& slot, std::uint64_t tick) noexcept {
  const Phase phase = slot.phase.load(std::memory_order_acquire);
  if (phase == Phase::idle || tick < slot.deadline_tick) return;
  if (phase != Phase::finished || slot.record.finish_ns > clock_.now_ns()) {
    account_late(slot);
    return;
  }
  if (!slot.abort_requested) slot.task.publish(slot.info);
  close_run(slot);
}

void BaseLoop::account_late(TaskSlot& slot) noexcept {
  TaskCounters& counters = slot.counters;
  if (!slot.miss_counted) {
    slot.miss_counted = true;
    counters.count_event(counters.deadline_misses, slot.record.warmup);
  }
  if (slot.spec.overrun != OverrunPolicy::abort || slot.abort_requested) return;
  slot.abort_requested = true;
  counters.count_event(counters.aborted, slot.record.warmup);
  Phase expected = Phase::released;
  if (!slot.phase.compare_exchange_strong(expected, Phase::idle, std::memory_order_acq_rel)) {
    slot.task.abort();
    return;
  }
  slot.record.not_started = true;
  slot.record.start_ns = clock_.now_ns();
  slot.record.finish_ns = slot.record.start_ns;
  slot.record.thread_free_ns = thread_is_busy(slot) ? slot.record.start_ns : slot.record.ready_ns;
  push_record(slot.record);
}

bool BaseLoop::thread_is_busy(const TaskSlot& waiting) const noexcept {
  return std::any_of(slots_.begin(), slots_.end(), [&](const auto& other) {
    return worker_of_[other->index] == worker_of_[waiting.index] &&
           other->phase.load(std::memory_order_relaxed) == Phase::running;
  });
}

void BaseLoop::close_run(TaskSlot& slot) noexcept {
  if (next_release_after_ns(slot, slot.record.ready_ns) < slot.record.finish_ns) note_overrun(slot);
  count_run(slot, slot.record, slot.miss_counted);
  slot.phase.store(Phase::idle, std::memory_order_relaxed);
}

void BaseLoop::account_remaining() noexcept {
  for (const auto& slot : slots_) {
    if (slot->phase.load(std::memory_order_acquire) == Phase::finished) close_run(*slot);
    if (slot->release_queued) slot->counters.count_event(slot->counters.skipped, slot->in_warmup());
  }
}

void BaseLoop::note_overrun(TaskSlot& slot) noexcept {
  if (slot.overrun_counted) return;
  slot.overrun_counted = true;
  slot.counters.count_event(slot.counters.overruns, slot.record.warmup);
}

void BaseLoop::push_record(const RunRecord& record) noexcept {
  if (clock_.is_virtual() && accounting_.base_runs().half_full()) accounting_.drain();
  accounting_.base_runs().push(record);
}

TickInfo BaseLoop::next_run_of(TaskSlot& slot, std::uint64_t tick) const noexcept {
  return {tick, due_ns(tick) - start_ns_, slot.period_ns, slot.next_run++};
}

RunRecord BaseLoop::new_record(const TaskSlot& slot, const TickInfo& info) const noexcept {
  RunRecord record;
  record.task = slot.index;
  record.warmup = info.run < slot.spec.warmup_runs;
  record.tick = info.tick;
  record.release_ns = due_ns(info.tick);
  // A queued release waited for the previous run, not for the base thread to wake.
  record.base_wake_ns = info.tick == next_tick_ ? base_wake_ns_ : record.release_ns;
  return record;
}

std::int64_t BaseLoop::next_release_after_ns(const TaskSlot& slot, std::int64_t instant_ns) const noexcept {
  const auto tick = static_cast<std::uint64_t>((instant_ns - start_ns_) / options_.base_period_ns + 1);
  const std::uint64_t past_release =
      (tick + slot.spec.every_ticks - slot.spec.offset_ticks) % slot.spec.every_ticks;
  return due_ns(past_release == 0 ? tick : tick + slot.spec.every_ticks - past_release);
}

void BaseLoop::count_run(TaskSlot& slot, const RunRecord& record, bool miss_counted) noexcept {
  TaskCounters& counters = slot.counters;
  (record.warmup ? counters.warmup_runs : counters.runs).add(1);
  const std::int64_t slack_ns = slot.deadline_ns - (record.finish_ns - record.release_ns);
  if (slack_ns < 0 && !miss_counted) counters.count_event(counters.deadline_misses, record.warmup);
  if (slot.spec.budget_ns > 0 && record.cpu_ns > slot.spec.budget_ns) {
    counters.count_event(counters.over_budget, record.warmup);
  }
  if (!record.warmup && slack_ns < counters.slack_min_ns.get()) counters.slack_min_ns.set(slack_ns);
}

}  // namespace hil::executive
