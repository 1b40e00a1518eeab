#pragma once
// Waiting until a word changes, and waking the waiting threads (Linux futex, private to the process).
// std::atomic::wait spins and yields first, which a SCHED_FIFO thread must not.

#include <atomic>
#include <cstdint>

#include <rtstdb/time.hpp>

namespace rtstdb::threads {

/// Sleeps while `word` equals `expected`; returns at once if it does not. May return early.
void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected) noexcept;
/// The same with a timeout.
void futex_wait_for(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                    Nanoseconds timeout) noexcept;
/// Uses only the address: the word may already be destroyed.
void futex_wake_all(const std::atomic<std::uint32_t>* word) noexcept;

/// A value below 2^31 that one thread sets and others wait for. Setting it makes a system call only if a
/// thread sleeps.
class FutexCell {
 public:
  explicit FutexCell(std::uint32_t value) : word_(value) {}

  std::uint32_t get() const noexcept { return word_.load(std::memory_order_acquire) & ~sleeper; }
  /// No thread may be waiting.
  void set(std::uint32_t value) noexcept { word_.store(value, std::memory_order_release); }
  /// Does not access the cell after the new value is visible, so that a waiter may destroy the cell.
  void set_and_wake(std::uint32_t value) noexcept {
    const std::atomic<std::uint32_t>* const address = &word_;
    if ((word_.exchange(value, std::memory_order_acq_rel) & sleeper) != 0) futex_wake_all(address);
  }
  /// Sleeps while the value is `value`.
  void wait_while(std::uint32_t value) noexcept;

 private:
  static constexpr std::uint32_t sleeper = 1u << 31;  ///< set by a thread that is about to sleep
  std::atomic<std::uint32_t> word_;
};

}  // namespace rtstdb::threads
