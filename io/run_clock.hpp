#pragma once
// Run time, and the clock that shows it to devices.

#include <cstdint>

namespace hil::io {

/// Nanoseconds since the run's first tick; negative before it.
using RunTimeNs = std::int64_t;

/// The time base of samples. It is monotonic.
class RunClock {
 public:
  virtual ~RunClock() = default;
  /// Until the time of the first tick is known, the clock shows a time far in the past that advances; then it
  /// jumps forward.
  virtual RunTimeNs now_ns() const noexcept = 0;
  /// Converts a stamp of now_ns() from before the jump to run time, once the first tick is known. Returns
  /// other times unchanged.
  virtual RunTimeNs to_run_time(RunTimeNs stamp_ns) const noexcept { return stamp_ns; }
};

}  // namespace hil::io
