#pragma once
// The state of a running run, for one console line per second.

#include <atomic>
#include <cstdint>
#include <limits>
#include <vector>

namespace hil::executive {

struct LiveTask {
  std::uint64_t runs = 0;
  std::uint64_t deadline_misses = 0;
  std::uint64_t overruns = 0;
  std::uint64_t skipped = 0;
  std::int64_t slack_min_ns = std::numeric_limits<std::int64_t>::max();  ///< max() before the first run
};

struct LiveSnapshot {
  std::uint64_t ticks_begun = 0;  ///< number of ticks that have begun; the watchdog uses it as a heartbeat
  std::int64_t run_time_ns = 0;   ///< release of the latest tick
  std::uint64_t skipped_ticks = 0;
  std::vector<LiveTask> tasks;  ///< in the order in which they were added
};

/// A number that one thread writes and any thread reads, wait-free.
template <typename Number>
class LiveNumber {
 public:
  explicit LiveNumber(Number initial = 0) noexcept : value_(initial) {}
  Number get() const noexcept { return value_.load(std::memory_order_relaxed); }
  void set(Number value) noexcept { value_.store(value, std::memory_order_relaxed); }
  void add(Number more) noexcept { set(get() + more); }

 private:
  std::atomic<Number> value_;
};

}  // namespace hil::executive
