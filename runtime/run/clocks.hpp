#pragma once
// The executive's clock as the clock of the database and of the devices.

#include <algorithm>
#include <atomic>

#include <rtstdb/time.hpp>

#include "io/device.hpp"
#include "runtime/executive/clock.hpp"

namespace hil::run {

/// Deadlines and costs of transactions are on the executive's clock.
class DatabaseClock final : public rtstdb::Clock {
 public:
  explicit DatabaseClock(const executive::Clock& clock) : clock_(clock) {}
  rtstdb::ClockTime now() const noexcept override { return rtstdb::clock_time_ns(clock_.now_ns()); }
  bool is_virtual() const noexcept override { return clock_.is_virtual(); }

 private:
  const executive::Clock& clock_;
};

/// Run time for devices: 0 at the first tick. The time of the first tick is not known while the run is
/// opened. Until set_origin, run time is therefore far below zero, so that no earlier stamp lies in the run
/// or is fresh in it.
class DeviceClock final : public io::RunClock {
 public:
  explicit DeviceClock(const executive::Clock& clock)
      : clock_(clock), early_origin_ns_(clock.now_ns() + before_run_ns), origin_ns_(early_origin_ns_) {}
  void set_origin(std::int64_t origin_ns) noexcept { origin_ns_.store(origin_ns, std::memory_order_relaxed); }
  std::int64_t origin_ns() const noexcept { return origin_ns_.load(std::memory_order_relaxed); }
  io::RunTimeNs now_ns() const noexcept override { return clock_.now_ns() - origin_ns(); }
  /// The time of an event in the report: one before the first tick has the time of that tick.
  io::RunTimeNs report_ns() const noexcept { return std::max<io::RunTimeNs>(now_ns(), 0); }
  io::RunTimeNs to_run_time(io::RunTimeNs stamp_ns) const noexcept override {
    const bool is_early = stamp_ns > -2 * before_run_ns && stamp_ns < -before_run_ns / 2;
    return is_early ? stamp_ns + early_origin_ns_ - origin_ns() : stamp_ns;
  }

 private:
  static constexpr std::int64_t before_run_ns = std::int64_t{365} * 24 * 3600 * 1'000'000'000;

  const executive::Clock& clock_;
  const std::int64_t early_origin_ns_;
  std::atomic<std::int64_t> origin_ns_;
};

}  // namespace hil::run
