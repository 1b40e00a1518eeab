#pragma once
// Two time bases that must not be mixed, as two types.
//   WorldTime   time of the simulated world: rows hold from a WorldTime on, queries have one. Its zero is
//               chosen by the caller.
//   ClockTime   time of the clock on which deadlines and costs are measured: CLOCK_MONOTONIC, or a virtual
//               clock. Its zero has no meaning.

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

/// Seconds from `from` to `to`. The difference is exact for any two times; the division to seconds rounds
/// once.
constexpr double seconds_between(WorldTime from, WorldTime to) {
  // Unsigned, because the difference of two distant times overflows a signed count.
  const auto from_ns = static_cast<std::uint64_t>(from.time_since_epoch().count());
  const auto to_ns = static_cast<std::uint64_t>(to.time_since_epoch().count());
  return to >= from ? static_cast<double>(to_ns - from_ns) / 1e9
                    : -static_cast<double>(from_ns - to_ns) / 1e9;
}

/// Interface through which the database reads the clock of deadlines. Any number of threads at the same time.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual ClockTime now() const noexcept = 0;
  /// True: time does not advance while the database works. Then admission by cost, chunks, calibration and
  /// time-outs are off.
  virtual bool is_virtual() const noexcept { return false; }
};

}  // namespace rtstdb
