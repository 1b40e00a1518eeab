#pragma once
// What the executive runs. A task is released every `every_ticks` ticks of the base rate, at `offset_ticks`.
//
// On the base thread, tasks of one tick run in the order they were added, and what one publishes the next one
// sees. A task on a thread of its own follows logical execution time: the base thread calls latch() at its
// release, the task's thread runs step() meanwhile, and the base thread calls publish() at the tick where the
// deadline falls, before that tick's tasks, neither earlier nor (unless it missed) later. So what others see
// does not depend on how long step() took, and a run under the virtual clock, where step() runs inline at the
// release, gives the same values. A run whose deadline tick lies past the end of the run is finished but not
// published.
//
// Tasks may share a thread: give them the same thread name. Of those released, the one with the shortest
// period goes first.

#include <cstdint>
#include <optional>
#include <string>

namespace hil::executive {

/// What happens to a release that arrives while the task still runs (an overrun), or waits for its thread.
enum class OverrunPolicy : std::uint8_t {
  /// It is dropped and counted as skipped. The late outputs are published as soon as they are there.
  skip,
  /// One such release is kept and run as soon as the task is free; more are skipped. On a thread of its own
  /// the kept release starts at the first tick that finds the task free; what Task::keep noted at its own tick is
  /// what it works on. Late outputs are published as soon as they are there.
  queue,
  /// Own thread only. At the deadline the step is asked to stop (Task::abort) and the outputs of that run are
  /// never
  /// published; if it had not started yet it never does. A release that still finds it running is skipped.
  abort,
};

struct TaskSpec {
  std::string name;
  std::uint32_t every_ticks = 1;   ///< base rate / task rate, at least 1
  std::uint32_t offset_ticks = 0;  ///< less than every_ticks
  /// From the release, at most one task period; 0: one task period. On its own thread: a multiple of the base
  /// period.
  std::int64_t deadline_ns = 0;
  /// CPU time one run may use; 0: no budget. More is counted, and names the cause of a miss. At most the
  /// deadline.
  std::int64_t budget_ns = 0;
  OverrunPolicy overrun = OverrunPolicy::skip;
  /// First runs, counted apart: never a deadline miss, not in the histograms.
  std::uint32_t warmup_runs = 0;
  std::string thread;  ///< empty: the base thread
};

std::int64_t effective_deadline_ns(const TaskSpec& spec, std::int64_t base_period_ns) noexcept;

/// What is wrong with a task, in words with its values; nothing when it can run.
std::optional<std::string> why_refused(const TaskSpec& spec, std::int64_t base_period_ns);

/// The tick a task was released at.
struct TickInfo {
  std::uint64_t tick = 0;      ///< index of the base tick, from 0
  std::int64_t time_ns = 0;    ///< run time of the release: tick * base period
  std::int64_t period_ns = 0;  ///< the task's own period
  std::uint64_t run = 0;       ///< index of this run of the task, from 0
};

class Task {
 public:
  virtual ~Task() = default;
  /// Base thread, at the release: copy the inputs the step will work on. Also the place to take back an
  /// abort() that came too late for the run before.
  virtual void latch(const TickInfo& tick) noexcept { (void)tick; }
  /// Base thread, own thread's task with OverrunPolicy::queue: a release that has to wait for the step under way.
  /// Note here what that run has to read as of its own tick; latch() of the same tick and run follows when it starts.
  virtual void keep(const TickInfo& tick) noexcept { (void)tick; }
  /// The work. On the base thread or on the task's own.
  virtual void step(const TickInfo& tick) noexcept = 0;
  /// Base thread: make the outputs visible. On the base thread directly after step; else at the deadline.
  virtual void publish(const TickInfo& tick) noexcept { (void)tick; }
  /// Base thread, OverrunPolicy::abort only, while step runs elsewhere: make that step return soon. May come
  /// just after step has returned.
  virtual void abort() noexcept {}
  /// Time the last step spent waiting for the database, and the GPU's share of it. Read after step on the
  /// same thread.
  virtual std::int64_t last_blocked_ns() const noexcept { return 0; }
  virtual std::int64_t last_gpu_ns() const noexcept { return 0; }
};

}  // namespace hil::executive
