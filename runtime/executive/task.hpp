#pragma once
// What the executive runs. A task is released every `every_ticks` ticks of the base rate, at `offset_ticks`.
//
// Tasks of the base thread run in the order in which they were added, and each one sees what the earlier ones
// of the same tick have published. A task on another thread follows logical execution time: the base thread
// calls latch() at its release, the task's thread runs step(), and the base thread calls publish() at the
// tick of the deadline, before that tick's tasks, never earlier and, unless the deadline was missed, never
// later. So the visible values do not depend on the duration of step(), and a run under the virtual clock,
// where step() runs inline at the release, gives the same values. A run whose deadline tick lies behind the
// end of the run is finished but not published.
//
// Tasks with the same thread name share a thread. Of the released ones, the task with the shortest period
// runs first.

#include <cstdint>
#include <optional>
#include <string>

namespace hil::executive {

/// What happens to a release that arrives while the task still runs (an overrun) or waits for its thread.
enum class OverrunPolicy : std::uint8_t {
  /// It is dropped and counted as skipped. Late outputs are published when the run has finished.
  skip,
  /// One such release is queued and runs when the task is free; further ones are skipped. On another thread
  /// the queued release starts at the first tick that finds the task free, with the inputs that Task::queue
  /// stored at its own tick. Late outputs are published when the run has finished.
  queue,
  /// Other threads only. At the deadline the executive calls Task::abort, and the outputs of that run are
  /// never published; if the run has not started, it is cancelled. A release that finds the task still
  /// running is skipped.
  abort,
};

struct TaskSpec {
  std::string name;
  std::uint32_t every_ticks = 1;   ///< base rate / task rate, at least 1
  std::uint32_t offset_ticks = 0;  ///< below every_ticks
  /// From the release, at most one task period; 0: one task period. On another thread: a multiple of the base
  /// period.
  std::int64_t deadline_ns = 0;
  /// CPU time that one run may use, at most the deadline; 0: no budget. Exceeding it is counted and can be
  /// the cause of a miss.
  std::int64_t budget_ns = 0;
  OverrunPolicy overrun = OverrunPolicy::skip;
  /// First runs, counted apart: never a deadline miss, not in the histograms.
  std::uint32_t warmup_runs = 0;
  std::string thread;  ///< empty: the base thread
};

std::int64_t effective_deadline_ns(const TaskSpec& spec, std::int64_t base_period_ns) noexcept;

/// Why a task is refused, with its values; empty: it is valid.
std::optional<std::string> why_refused(const TaskSpec& spec, std::int64_t base_period_ns);

/// The tick at which a task was released.
struct TickInfo {
  std::uint64_t tick = 0;      ///< index of the base tick, from 0
  std::int64_t time_ns = 0;    ///< run time of the release: tick * base period
  std::int64_t period_ns = 0;  ///< the task's own period
  std::uint64_t run = 0;       ///< index of this run of the task, from 0
};

class Task {
 public:
  virtual ~Task() = default;
  /// Base thread, at the release: copies the inputs for the step. Also reverts an abort() that came after the
  /// end of the previous run.
  virtual void latch(const TickInfo& tick) noexcept { (void)tick; }
  /// Base thread, for a task on another thread with OverrunPolicy::queue: a release has to wait for the
  /// running step. Stores the inputs of this tick; latch() with the same tick and run follows when that run
  /// starts.
  virtual void queue(const TickInfo& tick) noexcept { (void)tick; }
  /// Does the work, on the base thread or on the task's own thread.
  virtual void step(const TickInfo& tick) noexcept = 0;
  /// Base thread: makes the outputs visible; directly after step on the base thread, otherwise at the
  /// deadline.
  virtual void publish(const TickInfo& tick) noexcept { (void)tick; }
  /// Base thread, OverrunPolicy::abort only, while step runs on another thread: makes that step return soon.
  /// May be called just after step has returned.
  virtual void abort() noexcept {}
  /// How much longer than step() the step takes, by a fault of the run: the executive spends this time after
  /// it. Read after step on the same thread.
  virtual std::int64_t added_ns() const noexcept { return 0; }
  /// The time that the last step waited for the database, and the GPU's share of it. Read after step on the
  /// same thread.
  virtual std::int64_t last_blocked_ns() const noexcept { return 0; }
  virtual std::int64_t last_gpu_ns() const noexcept { return 0; }
};

}  // namespace hil::executive
