#pragma once
// The loop of the base thread: when each tick begins, and its stages. Nothing in here allocates, locks or
// writes files.
//
// Pacing. Tick k is due at start + k * period, an absolute time. A tick that is already due begins at once,
// so up to `catch_up_ticks` late ticks run back to back. When more are due, all but the latest due tick are
// skipped and counted. So the tick index equals the number of elapsed periods, and lags behind it by at most
// catch_up_ticks.

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/executive/accounting.hpp"
#include "runtime/executive/clock.hpp"
#include "runtime/executive/executive.hpp"
#include "runtime/executive/worker.hpp"

namespace hil::executive {

struct BaseBeat {
  std::atomic<std::uint64_t> ticks_begun{0};
  LiveNumber<std::int64_t> run_time_ns;
  LiveNumber<std::uint64_t> skipped_ticks;
  LiveNumber<std::uint64_t> skips;  ///< number of times that ticks were skipped
};

class BaseLoop {
 public:
  /// `worker_of[i]`: the thread of task i, or null if its steps run inline (tasks of the base thread, and all
  /// tasks under the virtual clock).
  BaseLoop(const ExecutiveOptions& options, const Probe& probe, const Accounting::Slots& slots,
           std::vector<Worker*> worker_of, Accounting& accounting, BaseBeat& beat);

  /// Runs until the duration is over (returns false) or a stop was requested (returns true).
  bool run(const std::atomic<bool>& stop_requested) noexcept;
  /// After the tasks' threads have ended: counts the runs that had not been accounted.
  void account_remaining() noexcept;

  std::int64_t start_ns() const noexcept { return start_ns_; }
  /// The index behind the last tick: the number of ticks that ran or were skipped.
  std::uint64_t next_tick() const noexcept { return next_tick_; }

 private:
  std::int64_t due_ns(std::uint64_t tick) const noexcept {
    return start_ns_ + static_cast<std::int64_t>(tick) * options_.base_period_ns;
  }
  bool wait_for_tick(const std::atomic<bool>& stop_requested) noexcept;
  std::uint64_t skip_late_ticks() noexcept;
  void run_tick(std::uint64_t skipped_before) noexcept;
  void run_tasks(std::uint64_t tick) noexcept;

  // Tasks of the base thread.
  bool admits(TaskSlot& slot, std::int64_t release_ns) noexcept;
  void run_here(TaskSlot& slot, std::uint64_t tick) noexcept;

  // Tasks on other threads.
  void release(TaskSlot& slot, std::uint64_t tick) noexcept;
  void begin_run(TaskSlot& slot, std::uint64_t tick) noexcept;
  void account(TaskSlot& slot, std::uint64_t tick) noexcept;
  void account_late(TaskSlot& slot) noexcept;
  bool thread_is_busy(const TaskSlot& waiting) const noexcept;
  void close_run(TaskSlot& slot) noexcept;
  void note_overrun(TaskSlot& slot) noexcept;

  void push_record(const RunRecord& record) noexcept;
  TickInfo next_run_of(TaskSlot& slot, std::uint64_t tick) const noexcept;
  RunRecord new_record(const TaskSlot& slot, const TickInfo& info) const noexcept;
  std::int64_t next_release_after_ns(const TaskSlot& slot, std::int64_t instant_ns) const noexcept;
  void count_run(TaskSlot& slot, const RunRecord& record, bool miss_counted) noexcept;

  const ExecutiveOptions& options_;
  Clock& clock_;
  const Probe& probe_;
  TickHooks& hooks_;
  const Accounting::Slots& slots_;
  const std::vector<Worker*> worker_of_;
  Accounting& accounting_;
  BaseBeat& beat_;

  std::int64_t start_ns_ = 0;
  std::uint64_t next_tick_ = 0;
  std::int64_t base_wake_ns_ = 0;  ///< end of the last sleep
  std::int64_t frame_begin_ns_ = 0;
  std::int64_t awake_ns_ = 0;
  std::int64_t ended_ns_ = 0;  ///< end of the last tick
  ThreadUsage last_usage_;  ///< the last reading of this thread's counters, valid while last_usage_is_valid_
  bool last_usage_is_valid_ = false;
};

}  // namespace hil::executive
