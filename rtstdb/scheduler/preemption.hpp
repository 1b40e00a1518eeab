#pragma once
// Preemption: which waiting transaction may run at a preemption point of the innermost run, when a run in
// execution gets a request for one, and how long that takes.
//
//   write helper, while a run waits for the device   request_if_useful
//   executor                                         sees requested(), ends the chunk early, reports a
//                                                    preemption point
//   engine                                           suspend; next() and execute in a loop; resume
//
// Two rules limit who may run above others. A second run can not stage writes, and a commit must keep the
// versions readable that the runs below read. A reserved transaction that can not run above the innermost run
// because of that makes it restart; nothing of it was published.
//
// Threads: the thread that holds the engine's lock, except requested(): the engine thread between begin_wait
// and end_wait.

#include <atomic>
#include <optional>

#include <rtstdb/time.hpp>

#include "rtstdb/scheduler/preemption_latency.hpp"
#include "rtstdb/scheduler/ready_queue.hpp"
#include "rtstdb/scheduler/reservations.hpp"
#include "rtstdb/scheduler/run_stack.hpp"
#include "rtstdb/store/store.hpp"

namespace rtstdb::scheduler {

class Preemption {
 public:
  /// All of these outlive it.
  Preemption(ReadyQueue& queue, const Reservations& reservations, const store::Store& store,
             const Clock& clock) noexcept
      : queue_(queue), reservations_(reservations), store_(store), clock_(clock) {}

  RunStack& runs() noexcept { return runs_; }
  const RunStack& runs() const noexcept { return runs_; }

  /// Whether the transaction could be executed now, above the runs in execution.
  bool can_execute(const ScheduledTransaction& transaction) const noexcept;
  /// The same, and the nesting limit allows it at a preemption point.
  bool may_nest(const ScheduledTransaction& waiting) const noexcept;

  // ---- a preemption point of the innermost run
  /// Whether a transaction waits that has precedence over the innermost run.
  bool is_due() const noexcept;
  /// The innermost run is preempted from now on.
  void suspend() noexcept;
  /// Takes the transaction that runs next out of the queue; null: none, the innermost run is to resume.
  ScheduledTransaction* next() noexcept;
  /// The innermost run executes again, unless its must_restart is set.
  void resume() noexcept;

  // ---- the innermost run waits until the device has completed what was in flight of the preempted run
  void begin_drain() noexcept;
  void end_drain() noexcept;

  // ---- the innermost run waits for the device
  void begin_wait() noexcept;
  void end_wait() noexcept;
  /// Requests a preemption point where a waiting transaction would run at it.
  void request_if_useful() noexcept;
  /// Whether the executor should end the chunk in flight early: a preemption point is requested, the run that
  /// waits was cancelled, or its firm deadline has passed.
  bool requested() const noexcept;

  /// An upper estimate of how long a higher-priority transaction waits until the device is free for it.
  Nanoseconds longest_latency(ClockTime now) const noexcept { return latency_.longest(now); }

 private:
  bool must_restart(const ScheduledTransaction& innermost) const noexcept;

  ReadyQueue& queue_;
  const Reservations& reservations_;
  const store::Store& store_;
  const Clock& clock_;
  RunStack runs_;
  PreemptionLatency latency_;
  ClockTime drain_began_{};
  const ScheduledTransaction* waiting_for_device_ = nullptr;  ///< the engine thread
  std::atomic<bool> requested_{false};
  std::optional<ClockTime> requested_at_;
};

}  // namespace rtstdb::scheduler
