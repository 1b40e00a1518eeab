#pragma once
// A thread for the tasks that name it. The base thread wakes it through a semaphore without waiting.

#include <semaphore.h>

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "runtime/executive/clock.hpp"
#include "runtime/executive/probe.hpp"
#include "runtime/executive/realtime.hpp"
#include "runtime/executive/spsc_ring.hpp"
#include "runtime/executive/task_slot.hpp"

namespace hil::executive {

/// CPU time and page faults of a thread; the difference of two readings is what a step used.
struct ThreadUsage {
  std::int64_t cpu_ns = 0;
  PageFaults faults;
};
inline ThreadUsage read_thread_usage(const Probe& probe) noexcept {
  return {probe.thread_cpu_ns(), probe.thread_faults()};
}
void record_usage(RunRecord& record, const ThreadUsage& before, const ThreadUsage& after) noexcept;

/// Uses the processor for this long, for Task::added_ns. Not under the virtual clock.
void spend(std::int64_t added_ns, const Clock& clock) noexcept;

/// Runs the step of `slot` on the calling thread and fills in its record.
void run_step(TaskSlot& slot, const Clock& clock, const Probe& probe) noexcept;

class Worker {
 public:
  Worker(std::string name, const Clock& clock, const Probe& probe, std::size_t ring_capacity);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  const std::string& name() const noexcept { return name_; }
  /// Before start().
  void add(TaskSlot& slot);
  std::int64_t shortest_period_ns() const noexcept;

  /// Returns when the thread is ready, with the options that the machine refused.
  std::vector<std::string> start(const RealtimeOptions& options, int priority);
  /// Base thread: a task of this thread was released. Never waits.
  void wake() noexcept;
  /// Runs the released tasks, then ends the thread and joins it.
  void stop();

  SpscRing<RunRecord>& records() noexcept { return records_; }

 private:
  void serve(const RealtimeOptions& options, int priority);
  TaskSlot* take_released() noexcept;
  void run(TaskSlot& slot) noexcept;

  SpscRing<RunRecord> records_;
  const std::string name_;
  const Clock& clock_;
  const Probe& probe_;
  std::vector<TaskSlot*> slots_;  ///< by period
  std::int64_t free_ns_ = 0;      ///< end of the last run on this thread
  std::vector<std::string> refused_;
  std::atomic<bool> stopping_{false};
  sem_t wake_{};
  sem_t ready_{};
  std::thread thread_;
};

}  // namespace hil::executive
