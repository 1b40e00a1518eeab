#pragma once
// An upper estimate of the preemption latency: how long those that preempt others waited until the device was
// free for them. It is a chunk where elements cost what was predicted, else the time to halt one; and where
// single elements take long, their time.
//
// Threads: one at a time.

#include <algorithm>
#include <cmath>

#include <rtstdb/time.hpp>

namespace rtstdb::scheduler {

class PreemptionLatency {
 public:
  /// A transaction waited this long. A single long wait may be the operating system's: it raises the estimate
  /// by half.
  void update(Nanoseconds wait, ClockTime now) noexcept {
    const Nanoseconds before = longest(now);
    longest_ = std::max(before, std::min(wait, std::max(before + before / 2, Nanoseconds(min_step))));
    updated_at_ = now;
  }
  /// The estimate; it halves each second without a long wait.
  Nanoseconds longest(ClockTime now) const noexcept {
    const double seconds = std::chrono::duration<double>(now - updated_at_).count();
    return Nanoseconds(std::llround(static_cast<double>(longest_.count()) * std::exp2(-seconds)));
  }

 private:
  static constexpr Nanoseconds min_step{500'000};
  Nanoseconds longest_{0};
  ClockTime updated_at_;
};

}  // namespace rtstdb::scheduler
