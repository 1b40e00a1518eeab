#pragma once
// The simulated clock of a database.

#include <atomic>
#include <cstdint>
#include <functional>
#include <utility>

#include <rtstdb/time.hpp>

namespace hil::tests {

/// Advances by advance(), by `per_reading_ns` at every reading, and by one jump at a later reading.
class SimulatedClock final : public rtstdb::Clock {
 public:
  rtstdb::ClockTime now() const noexcept override {
    if (readings_to_jump_.load() > 0 && readings_to_jump_.fetch_sub(1) == 1)
      now_ns_.fetch_add(jump_ns_.load());
    if (readings_to_event_.load() > 0 && readings_to_event_.fetch_sub(1) == 1) event_();
    return rtstdb::clock_time_ns(now_ns_.fetch_add(per_reading_ns.load()));
  }
  bool is_virtual() const noexcept override { return virtual_time; }

  void advance(rtstdb::Nanoseconds by) noexcept { now_ns_.fetch_add(by.count()); }
  /// The clock advances by `by` before the `reading`-th reading from now (1: the next).
  void jump_before_reading(int reading, rtstdb::Nanoseconds by) {
    jump_ns_ = by.count();
    readings_to_jump_ = reading;
  }
  void cancel_jump() { readings_to_jump_ = 0; }
  /// Calls `event` in the `reading`-th reading from now. Not during a reading.
  void call_at_reading(int reading, std::function<void()> event) {
    event_ = std::move(event);
    readings_to_event_ = reading;
  }
  /// The time, without a reading.
  rtstdb::ClockTime peek() const { return rtstdb::clock_time_ns(now_ns_.load()); }

  std::atomic<std::int64_t> per_reading_ns{0};
  bool virtual_time = false;

 private:
  mutable std::atomic<std::int64_t> now_ns_{1'000'000'000};
  mutable std::atomic<int> readings_to_jump_{0};
  std::atomic<std::int64_t> jump_ns_{0};
  mutable std::atomic<int> readings_to_event_{0};
  std::function<void()> event_;
};

}  // namespace hil::tests
