#pragma once
// Clocks of a run, for tests of devices.

#include <atomic>
#include <chrono>

#include "io/device.hpp"

namespace hil::io {

/// Shows the time that was set.
class SetClock final : public RunClock {
 public:
  RunTimeNs now_ns() const noexcept override { return now_ns_.load(); }
  void set(RunTimeNs now_ns) noexcept { now_ns_.store(now_ns); }

 private:
  std::atomic<RunTimeNs> now_ns_{0};
};

/// Real time since its construction.
class RunningClock final : public RunClock {
 public:
  RunTimeNs now_ns() const noexcept override {
    return std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace hil::io
