#pragma once
// What a CAN device has counted, and how its thread counts so that others can read at any time.

#include <atomic>
#include <cstdint>
#include <limits>

#include "io/can/bus.hpp"
#include "io/can/frame.hpp"

namespace hil::io::can {

struct CanCounters {
  std::uint64_t rx = 0;       ///< frames of other stations, error frames not among them
  std::uint64_t tx = 0;       ///< frames sent: those seen on the bus and injected.dropped_tx
  std::uint64_t dropped = 0;  ///< frames the bus lost because someone was too slow (Bus::counters)
  std::uint64_t errors = 0;   ///< error frames
  std::uint64_t no_buffer =
      0;  ///< sends refused because the queue was full; each is tried once more, next tick
  std::uint64_t send_errors = 0;   ///< sends that failed otherwise (bus lost)
  std::uint64_t bad_checksum = 0;  ///< received frames refused for their checksum
  std::uint64_t bad_counter = 0;   ///< received frames refused for their counter
  std::uint64_t wrong_length =
      0;  ///< received frames refused for their length, or because they were remote requests
  std::uint64_t unknown_id = 0;        ///< frames with an identifier of no message to receive
  std::uint64_t saturated = 0;         ///< output values out of their signal's range
  std::uint64_t refused_values = 0;    ///< output values that were NaN
  std::uint64_t dropped_releases = 0;  ///< ticks whose outputs found the hand-over queue full
  std::uint64_t log_dropped = 0;       ///< frames missing in the log
  std::uint64_t lost_arrivals = 0;     ///< CanDevice::lost_arrivals
  InjectedFaults injected;
  double bus_load = 0.0;  ///< share of the bit rate in the last whole tenth of a second, stuff bits left out
};

/// One thread adds, any thread reads.
class Count {
 public:
  void add(std::uint64_t more = 1) noexcept { value_.store(get() + more, std::memory_order_relaxed); }
  std::uint64_t get() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

/// One thread adds, any thread reads the load.
class BusLoadMeter {
 public:
  explicit BusLoadMeter(double bits_per_second) : bits_per_window_(bits_per_second * window_s) {}

  void advance(RunTimeNs now_ns) noexcept {
    if (now_ns < window_end_ns_) return;
    const bool just_ended = window_end_ns_ > never_ns && now_ns - window_end_ns_ < window_ns;
    load_.store(just_ended ? static_cast<double>(bits_) / bits_per_window_ : 0.0, std::memory_order_relaxed);
    bits_ = 0;
    const RunTimeNs into_window_ns = (now_ns % window_ns + window_ns) % window_ns;  // also before the run
    window_end_ns_ = now_ns - into_window_ns + window_ns;
  }
  void add(const Frame& frame) noexcept {
    advance(frame.time_ns);
    bits_ += wire_bits(frame);
  }
  double load() const noexcept { return load_.load(std::memory_order_relaxed); }

 private:
  static constexpr double window_s = 0.1;
  static constexpr RunTimeNs window_ns = 100'000'000;
  static constexpr RunTimeNs never_ns = std::numeric_limits<RunTimeNs>::min();

  double bits_per_window_;
  std::uint64_t bits_ = 0;
  RunTimeNs window_end_ns_ = never_ns;
  std::atomic<double> load_{0.0};
};

}  // namespace hil::io::can
