#pragma once
// The executive's state of one task: its release times, its current run and its counters.
//
// Threads: everything belongs to the base thread, except what Phase hands over. A run on another thread goes
// from idle to released (by the base thread), running and finished (by its thread), and idle (by the base
// thread); or from released to idle when it is cancelled. While it is running, `record` and `info` belong to
// the task's thread.

#include <atomic>
#include <cstdint>
#include <limits>
#include <utility>

#include "runtime/executive/live.hpp"
#include "runtime/executive/records.hpp"
#include "runtime/executive/task.hpp"

namespace hil::executive {

enum class Phase : std::uint8_t { idle, released, running, finished };

/// Counters that the base thread writes and any thread may read.
struct TaskCounters {
  LiveNumber<std::uint64_t> runs;
  LiveNumber<std::uint64_t> warmup_runs;
  LiveNumber<std::uint64_t> deadline_misses;
  LiveNumber<std::uint64_t> overruns;
  LiveNumber<std::uint64_t> skipped;
  LiveNumber<std::uint64_t> aborted;
  LiveNumber<std::uint64_t> over_budget;
  LiveNumber<std::uint64_t> warmup_problems;
  LiveNumber<std::int64_t> slack_min_ns{std::numeric_limits<std::int64_t>::max()};

  /// Counts an event, for warm-up runs separately.
  void count_event(LiveNumber<std::uint64_t>& kind, bool warmup, std::uint64_t times = 1) noexcept {
    (warmup ? warmup_problems : kind).add(times);
  }
};

struct TaskSlot {
  TaskSlot(TaskSpec task_spec, Task& its_task, std::uint32_t its_index, std::int64_t base_period_ns)
      : spec(std::move(task_spec)),
        task(its_task),
        index(its_index),
        period_ns(base_period_ns * spec.every_ticks),
        deadline_ns(effective_deadline_ns(spec, base_period_ns)),
        deadline_ticks(static_cast<std::uint64_t>(deadline_ns / base_period_ns)) {}

  bool on_base_thread() const noexcept { return spec.thread.empty(); }
  bool released_at(std::uint64_t tick) const noexcept { return tick % spec.every_ticks == spec.offset_ticks; }
  /// The number of releases in the ticks before `tick`.
  std::uint64_t releases_before(std::uint64_t tick) const noexcept {
    return tick <= spec.offset_ticks ? 0 : (tick - spec.offset_ticks - 1) / spec.every_ticks + 1;
  }
  /// Whether the current state is that of a warm-up run: none has ended yet, or the latest run is one.
  bool in_warmup() const noexcept { return spec.warmup_runs > 0 && next_run <= spec.warmup_runs; }

  const TaskSpec spec;
  Task& task;
  const std::uint32_t index;
  const std::int64_t period_ns;
  const std::int64_t deadline_ns;
  const std::uint64_t deadline_ticks;  ///< other thread: deadline in ticks

  TaskCounters counters;
  std::uint64_t next_run = 0;

  // Base thread: which releases were overrun by the previous run. See base_loop.cpp.
  std::int64_t last_start_ns = 0;
  std::int64_t last_finish_ns = 0;
  std::int64_t dropped_until_ns = 0;

  // Other thread: the current run.
  std::atomic<Phase> phase{Phase::idle};
  TickInfo info;
  RunRecord record;
  std::uint64_t deadline_tick = 0;
  bool abort_requested = false;
  bool miss_counted = false;
  bool overrun_counted = false;
  bool release_queued = false;  ///< OverrunPolicy::queue: one release is queued
  std::uint64_t queued_tick = 0;
};

}  // namespace hil::executive
