#pragma once
// A lost device: another one is opened while the write helper goes on with transactions that only write. A
// transaction with queries waits for the new device, unless its deadline is firm and comes before the device
// can.
//
// Threads: the thread that holds the engine's lock; revive releases it in its wait (ExecutorCallbacks).

#include <optional>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/ready_queue.hpp"
#include "rtstdb/scheduler/scheduled_transaction.hpp"

namespace rtstdb::transaction {

class DeviceRevival {
 public:
  DeviceRevival(query::Executor& executor, scheduler::ReadyQueue& queue, const Clock& clock) noexcept
      : executor_(executor), queue_(queue), clock_(clock) {}

  bool is_needed() const noexcept { return executor_.lost(); }
  /// Misuse inside a run of the executor.
  void revive(query::ExecutorCallbacks& callbacks) noexcept;
  /// Takes a transaction out of the queue that the new device will come too late for; null: none. Such a
  /// transaction ends as device_lost.
  scheduler::ScheduledTransaction* pop_unmeetable() noexcept;

 private:
  query::Executor& executor_;
  scheduler::ReadyQueue& queue_;
  const Clock& clock_;
  std::optional<ClockTime> expected_back_;  ///< while the device is being revived
};

}  // namespace rtstdb::transaction
