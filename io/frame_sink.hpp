#pragma once
// The port to what records the frames of a bus.

#include <array>
#include <cstdint>

#include "io/device.hpp"

namespace hil::io {

/// A frame as it was on the bus.
struct BusFrame {
  RunTimeNs time_ns = 0;  ///< negative: before the first tick
  std::uint32_t id = 0;   ///< without flags
  bool extended = false;  ///< the identifier has 29 bits
  bool fd = false;
  bool remote = false;  ///< a request without data
  bool error = false;   ///< an error frame; `id` is its class
  bool sent = false;    ///< by the run; else received
  std::uint8_t size = 0;
  std::array<std::uint8_t, 64> data{};  ///< the first `size` bytes; of a remote request none
};

/// Threads: take is called by one thread, the device's own; under the virtual clock the tick.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Neither allocates nor blocks under the real-time clock.
  virtual void take(const BusFrame& frame) noexcept = 0;
};

}  // namespace hil::io
