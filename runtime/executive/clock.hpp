#pragma once
// The executive's clock port and its two implementations. Times are nanoseconds of one monotonic clock with
// an arbitrary zero.

#include <atomic>
#include <cstdint>

namespace hil::executive {

class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() const noexcept = 0;
  /// Returns at or after `wake_ns`, or early when a signal interrupts it; callers check the time again.
  virtual void sleep_until(std::int64_t wake_ns) noexcept = 0;
  virtual bool is_virtual() const noexcept = 0;
};

/// CLOCK_MONOTONIC with clock_nanosleep(TIMER_ABSTIME).
class MonotonicClock final : public Clock {
 public:
  std::int64_t now_ns() const noexcept override;
  void sleep_until(std::int64_t wake_ns) noexcept override;
  bool is_virtual() const noexcept override { return false; }
};

/// Advances only in sleep_until(), so a run proceeds as fast as possible and every time in it is a function
/// of the run's inputs. One thread sleeps; any thread may read.
class VirtualClock final : public Clock {
 public:
  std::int64_t now_ns() const noexcept override { return now_ns_.load(std::memory_order_relaxed); }
  void sleep_until(std::int64_t wake_ns) noexcept override {
    if (wake_ns > now_ns()) now_ns_.store(wake_ns, std::memory_order_relaxed);
  }
  bool is_virtual() const noexcept override { return true; }

 private:
  std::atomic<std::int64_t> now_ns_{0};
};

}  // namespace hil::executive
