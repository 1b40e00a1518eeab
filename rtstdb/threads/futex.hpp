#pragma once
// Sleeping until a word changes, and waking who sleeps on it (Linux futex, private to the process).
// std::atomic's wait spins and yields first, which a SCHED_FIFO thread must not.

#include <atomic>
#include <cstdint>

#include <rtstdb/time.hpp>

namespace rtstdb::threads {

/// Sleeps while `word` is `expected`; returns at once when it is not. May return early.
void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected) noexcept;
/// So long at most.
void futex_wait_for(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                    Nanoseconds at_most) noexcept;
/// Only the address is used: the word may be gone already.
void futex_wake_all(const std::atomic<std::uint32_t>* word) noexcept;

/// A small value (below 2^31) that one thread sets for good and others wait for. Setting costs a system call
/// only when somebody sleeps.
class FutexCell {
 public:
  explicit FutexCell(std::uint32_t value) : word_(value) {}

  std::uint32_t get() const noexcept { return word_.load(std::memory_order_acquire) & ~sleeper; }
  /// Nobody waits.
  void set(std::uint32_t value) noexcept { word_.store(value, std::memory_order_release); }
  /// The cell is not touched once the value can be seen: whoever waits may destroy it.
  void set_and_wake(std::uint32_t value) noexcept {
    const std::atomic<std::uint32_t>* const address = &word_;
    if ((word_.exchange(value, std::memory_order_acq_rel) & sleeper) != 0) futex_wake_all(address);
  }
  void wait_while(std::uint32_t value) noexcept;

 private:
  static constexpr std::uint32_t sleeper = 1u << 31;  ///< set by who is about to sleep
  std::atomic<std::uint32_t> word_;
};

}  // namespace rtstdb::threads
