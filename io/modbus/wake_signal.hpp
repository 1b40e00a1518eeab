#pragma once
// Wakes one thread. Several wake-ups before the thread waits count as one.
//
// Threads: wake from any thread, never blocks; wait and wait_for from the thread that is woken.

#include <semaphore.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <ctime>

namespace hil::io::modbus {

class WakeSignal {
 public:
  WakeSignal() { sem_init(&semaphore_, 0, 0); }
  ~WakeSignal() { sem_destroy(&semaphore_); }
  WakeSignal(const WakeSignal&) = delete;
  WakeSignal& operator=(const WakeSignal&) = delete;

  void wake() noexcept {
    // One post at a time is sufficient, and prevents the semaphore from overflowing while no thread waits.
    if (!is_pending_.exchange(true)) sem_post(&semaphore_);
  }
  void wait() noexcept {
    while (sem_wait(&semaphore_) != 0 && errno == EINTR) {
    }
    take();
  }
  void wait_for(std::chrono::nanoseconds limit) noexcept {
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    constexpr std::int64_t second = 1'000'000'000;
    const std::int64_t at = until.tv_sec * second + until.tv_nsec + std::max<std::int64_t>(limit.count(), 0);
    until = {at / second, at % second};
    while (sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &until) != 0 && errno == EINTR) {
    }
    take();
  }

 private:
  /// An exchange, not a store, which synchronizes with the wake-up that it consumes.
  void take() noexcept { is_pending_.exchange(false); }

  sem_t semaphore_{};
  std::atomic<bool> is_pending_{false};
};

}  // namespace hil::io::modbus
