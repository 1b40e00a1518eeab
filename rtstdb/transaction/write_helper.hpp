#pragma once
// The engine's lock, and a second thread that works under it while the engine thread waits for the device: it
// admits new transactions and commits those that only write. So a write waits microseconds for the queries of
// another transaction.
//
// Threads: as each function says.

#include <atomic>
#include <mutex>
#include <thread>

#include "rtstdb/threads/event_count.hpp"

namespace rtstdb::transaction {

class WriteHelper {
 public:
  /// What the helper does in a wait.
  class Work {
   public:
    /// The helper's thread, holding the lock. It returns soon once device_is_done().
    virtual void work_in_wait() noexcept = 0;

   protected:
    ~Work() = default;
  };

  explicit WriteHelper(Work& work) noexcept : work_(work) {}
  /// Misuse while the thread runs.
  ~WriteHelper() = default;

  // ---- setup
  /// Starts the thread. Errors: std::system_error.
  void start();
  /// Ends the thread, which must not be working; does nothing where none was started.
  void stop() noexcept;
  std::thread& thread() noexcept { return thread_; }

  /// The thread that executes transactions holds it.
  std::mutex& lock() noexcept { return lock_; }

  // ---- the engine thread, holding the lock
  /// Releases the lock for a wait for the device. `has_work()` says whether there is work already.
  template <class HasWork>
  void begin_wait(HasWork has_work) noexcept {
    // Pairs with notify: either its caller sees the flag, or has_work sees what its caller did before.
    in_wait_.store(true, std::memory_order_seq_cst);
    const bool has_more = has_work();
    lock_.unlock();
    if (has_more) wake_up_.notify();
  }
  /// Takes the lock back.
  void end_wait() noexcept;

  // ---- any thread
  /// There may be work. Wakes the helper where the engine thread waits for the device.
  void notify() noexcept {
    if (in_wait_.load(std::memory_order_seq_cst)) wake_up_.notify();
  }

  // ---- the helper's thread, in work_in_wait
  /// The engine thread waits for the lock.
  bool device_is_done() const noexcept { return device_is_done_.load(std::memory_order_relaxed); }

 private:
  void run_thread() noexcept;

  Work& work_;
  std::mutex lock_;
  threads::EventCount wake_up_;
  std::atomic<bool> in_wait_{false};
  std::atomic<bool> device_is_done_{false};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace rtstdb::transaction
