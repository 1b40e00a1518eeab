#pragma once
// One clock of the executive seen through the ports of the database and of the devices.

#include <atomic>

#include <rtstdb/time.hpp>

#include "io/device.hpp"
#include "runtime/executive/clock.hpp"

namespace hil::run {

/// Deadlines and costs of transactions are measured on the executive's clock.
class DatabaseClock final : public rtstdb::Clock {
 public:
  explicit DatabaseClock(const executive::Clock& clock) : clock_(clock) {}
  rtstdb::ClockTime now() const noexcept override { return rtstdb::clock_time_ns(clock_.now_ns()); }
  bool is_virtual() const noexcept override { return clock_.is_virtual(); }

 private:
  const executive::Clock& clock_;
};

/// Run time for devices: 0 at the first tick. Before the origin is known, the time since construction counts
/// down from it.
class DeviceClock final : public io::RunClock {
 public:
  explicit DeviceClock(const executive::Clock& clock) : clock_(clock), origin_ns_(clock.now_ns()) {}
  void set_origin(std::int64_t origin_ns) noexcept { origin_ns_.store(origin_ns, std::memory_order_relaxed); }
  std::int64_t origin_ns() const noexcept { return origin_ns_.load(std::memory_order_relaxed); }
  io::RunTimeNs now_ns() const noexcept override { return clock_.now_ns() - origin_ns(); }

 private:
  const executive::Clock& clock_;
  std::atomic<std::int64_t> origin_ns_;
};

}  // namespace hil::run
