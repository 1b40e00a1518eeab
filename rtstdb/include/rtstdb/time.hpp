#pragma once
// Two clocks that must not be mixed, as two types.
//   WorldTime   the simulated world's own time: rows hold from one, queries ask at one. Zero is the caller's
//   choice. ClockTime   the clock that deadlines and costs are measured on (CLOCK_MONOTONIC, or a virtual
//   one). Zero means nothing.

#include <chrono>
#include <cstdint>

namespace rtstdb {

using Nanoseconds = std::chrono::duration<std::int64_t, std::nano>;

struct WorldTimeBase {
  using duration = Nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<WorldTimeBase, duration>;
  static constexpr bool is_steady = false;
};
using WorldTime = WorldTimeBase::time_point;

struct ClockTimeBase {
  using duration = Nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<ClockTimeBase, duration>;
  static constexpr bool is_steady = true;
};
using ClockTime = ClockTimeBase::time_point;

constexpr WorldTime world_time_ns(std::int64_t ns) {
  return WorldTime(Nanoseconds(ns));
}
constexpr ClockTime clock_time_ns(std::int64_t ns) {
  return ClockTime(Nanoseconds(ns));
}

/// Seconds from `from` to `to`, exact to the nanosecond before the division.
constexpr double seconds_between(WorldTime from, WorldTime to) {
  return static_cast<double>((to - from).count()) * 1e-9;
}

/// The port through which the database reads the deadline clock. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual ClockTime now() const noexcept = 0;
  /// True: time stands still while work is done, so admission by cost and time-outs make no sense and are
  /// off.
  virtual bool is_virtual() const noexcept { return false; }
};

}  // namespace rtstdb
