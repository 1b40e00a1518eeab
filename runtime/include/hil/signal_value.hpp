#pragma once
// The value of a signal, as its readers see it. Threads: plain data.

#include <cstdint>
#include <limits>

namespace hil::signals {

/// A value and its run time: the arrival of the bytes for a device's input, the tick for a module's output.
/// `fresh` is false before the first write and while the writer is lost.
struct SignalValue {
  double value = 0.0;
  std::int64_t time_ns = std::numeric_limits<std::int64_t>::min();
  bool fresh = false;
  /// Of a variable: time_ns less the time at which the oldest of its signals was written; of a constant far
  /// below 0.
  std::int64_t spread_ns = 0;
};

}  // namespace hil::signals
