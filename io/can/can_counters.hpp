#pragma once
// The counters of a CAN device. Its thread updates them; any thread may read them at any time.

#include <atomic>
#include <cstdint>
#include <limits>
#include <string>

#include "io/can/can_transport.hpp"
#include "io/can/frame.hpp"

namespace hil::io::can {

struct CanCounters {
  std::uint64_t rx = 0;       ///< frames of other stations, without error frames
  std::uint64_t tx = 0;       ///< frames sent: those seen on the bus and injected.dropped_tx
  std::uint64_t played = 0;   ///< frames of the log that were sent; those are neither in rx nor in tx
  std::uint64_t dropped = 0;  ///< frames lost because a station was too slow (CanTransport::counters)
  std::uint64_t errors = 0;   ///< error frames
  std::uint64_t no_buffer =
      0;  ///< sends refused because the queue was full; each is retried once, in the next tick
  std::uint64_t send_errors = 0;   ///< sends that failed otherwise (bus lost), without those of the log
  std::uint64_t bad_checksum = 0;  ///< received frames rejected for their checksum
  std::uint64_t bad_counter = 0;   ///< received frames rejected for their counter
  /// Received frames rejected as remote requests, or for their format: classic although the message is FD, or
  /// the reverse.
  std::uint64_t wrong_kind = 0;
  std::uint64_t unknown_id = 0;        ///< frames with an identifier of no message to receive
  std::uint64_t saturated = 0;         ///< output values outside their signal's range
  std::uint64_t refused_values = 0;    ///< output values that were NaN
  std::uint64_t dropped_releases = 0;  ///< ticks whose outputs were dropped because the queue was full
  std::uint64_t log_dropped = 0;       ///< frames missing in the log
  std::uint64_t lost_arrivals = 0;     ///< CanDevice::lost_arrivals
  InjectedFaults injected;
  // Fractions of the bit rate without stuff bits, over whole tenths of a second from run time 0 to the safe
  // state.
  double bus_load = 0.0;                                            ///< in the last tenth of a second
  double bus_load_peak = 0.0;                                       ///< in the busiest tenth of a second
  double bus_load_mean = std::numeric_limits<double>::quiet_NaN();  ///< over all of them; NaN: there was none
};

/// Accepted frames of one message whose length differs from that of the message. A shorter frame updates the
/// signals that it contains completely; the excess bytes of a longer frame are padding.
struct LengthCounts {
  std::string message;
  std::uint64_t longer = 0;
  std::uint64_t shorter = 0;
};

/// Received frames of one message that were rejected.
struct RejectionCounts {
  std::string message;
  std::uint64_t bad_checksum = 0;
  std::uint64_t bad_counter = 0;
  std::uint64_t wrong_kind = 0;
  std::uint64_t by_scenario = 0;  ///< of all these: RejectedFrames::by_scenario
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
    if (ended_ || now_ns < window_end_ns_) return;
    const auto silent = static_cast<std::uint64_t>((now_ns - window_end_ns_) / window_ns);
    const double load = static_cast<double>(bits_) / bits_per_window_;
    latest_.store(silent == 0 ? load : 0.0, std::memory_order_relaxed);
    if (load > peak_.load(std::memory_order_relaxed)) peak_.store(load, std::memory_order_relaxed);
    whole_bits_.add(bits_);
    windows_.add(silent + 1);
    bits_ = 0;
    window_end_ns_ = (now_ns / window_ns + 1) * window_ns;
  }
  void add(const Frame& frame) noexcept {
    advance(frame.time_ns);
    if (frame.time_ns >= 0) bits_ += wire_bits(frame);
  }
  /// Ends the measurement.
  void end() noexcept { ended_ = true; }

  double latest() const noexcept { return latest_.load(std::memory_order_relaxed); }
  double peak() const noexcept { return peak_.load(std::memory_order_relaxed); }
  double mean() const noexcept {
    const auto windows = static_cast<double>(windows_.get());
    return windows > 0.0 ? static_cast<double>(whole_bits_.get()) / (windows * bits_per_window_)
                         : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  static constexpr double window_s = 0.1;
  static constexpr RunTimeNs window_ns = 100'000'000;

  double bits_per_window_;
  std::uint64_t bits_ = 0;
  RunTimeNs window_end_ns_ = window_ns;
  bool ended_ = false;
  std::atomic<double> latest_{0.0}, peak_{0.0};
  Count whole_bits_, windows_;
};

}  // namespace hil::io::can
