#pragma once
// The transactions in execution, one above the other: who was preempted by whom, and the time that counts for
// each.
//
// A run is preempted at one of its preemption points by the run above it, which ends before it resumes. One
// run may stand above a run that is not preempted: a transaction that only writes, executed by the write
// helper while the run below waits for the device.
//
// The time of a run counts while the engine or the device works for it. It stops when the run is preempted.
// At the begin of a run above, the device may still work for the preempted one: that time counts for the
// preempted run, not for the one that waits.
//
// Threads: the thread that holds the engine's lock.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include <rtstdb/result.hpp>
#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/scheduled_transaction.hpp"

namespace rtstdb::scheduler {

/// A stopwatch on the deadline clock.
class RunTime {
 public:
  void start(ClockTime now) noexcept { running_since_ = now; }
  void stop(ClockTime now) noexcept {
    total_ = total(now);
    running_since_.reset();
  }
  Nanoseconds total(ClockTime now) const noexcept {
    return running_since_ ? total_ + (now - *running_since_) : total_;
  }

 private:
  Nanoseconds total_{0};
  std::optional<ClockTime> running_since_;
};

/// One transaction in execution.
struct Run {
  ScheduledTransaction* transaction = nullptr;
  RunTime time;
  std::optional<Version> reading;         ///< the version that it reads; commits must keep it readable
  bool staged = false;                    ///< its writes are staged; no other run's can be
  std::optional<ClockTime> preempted_at;  ///< none while it executes
  Nanoseconds point_requested_for{0};     ///< how long its last preemption point had been requested
  bool must_restart = false;              ///< it stops, to be begun again later
  // Of a run whose answers may be partial (transaction/late_answers.hpp).
  std::optional<ClockTime> resumed_at;  ///< the end of its last preemption point
  Nanoseconds last_chunk{0};            ///< from there to the begin of this one
};

class RunStack {
 public:
  /// Begins a run above all others; its time counts from `now` on. Misuse with more than max_nesting + 2
  /// runs.
  Run& push(ScheduledTransaction& transaction, ClockTime now) noexcept {
    RTSTDB_ASSERT(count_ < runs_.size(), "more runs than max_nesting + 2");
    Run& run = runs_[count_++];
    run = {};
    run.transaction = &transaction;
    run.time.start(now);
    return run;
  }
  /// Ends the innermost run.
  void pop() noexcept {
    RTSTDB_ASSERT(count_ > 0, "no run is in progress");
    --count_;
  }

  bool empty() const noexcept { return count_ == 0; }
  std::uint32_t depth() const noexcept { return count_; }
  /// All runs, the innermost last.
  std::span<const Run> all() const noexcept { return std::span(runs_).first(count_); }
  /// Misuse when empty.
  Run& innermost() noexcept { return runs_[count_ - 1]; }
  const Run& innermost() const noexcept { return runs_[count_ - 1]; }
  /// The run that the innermost one preempts, or null.
  Run* preempted_by_innermost() noexcept {
    return count_ > 1 && runs_[count_ - 2].preempted_at ? &runs_[count_ - 2] : nullptr;
  }
  bool any_staged() const noexcept { return std::ranges::any_of(all(), &Run::staged); }

 private:
  std::array<Run, query::max_nesting + 2> runs_{};
  std::uint32_t count_ = 0;
};

}  // namespace rtstdb::scheduler
