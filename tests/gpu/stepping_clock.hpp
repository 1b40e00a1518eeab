#pragma once
// A clock that advances by a step with each reading: what is in time does not depend on the machine.

#include <atomic>

#include <rtstdb/time.hpp>

namespace rtstdb::test {

class SteppingClock final : public Clock {
 public:
  explicit SteppingClock(Nanoseconds step = Nanoseconds(1'000'000'000), bool is_virtual = true)
      : step_ns_(step.count()), is_virtual_(is_virtual) {}
  ClockTime now() const noexcept override {
    return clock_time_ns(1'000'000'000 + step_ns_ * readings_.fetch_add(1, std::memory_order_relaxed));
  }
  bool is_virtual() const noexcept override { return is_virtual_; }
  /// Between the `count`-th reading from now and the next one.
  ClockTime after_readings(std::int64_t count) const {
    return clock_time_ns(1'000'000'000 + step_ns_ * (readings_ + count - 1) + step_ns_ / 2);
  }

 private:
  const std::int64_t step_ns_;
  const bool is_virtual_;
  mutable std::atomic<std::int64_t> readings_{0};
};

}  // namespace rtstdb::test
