#pragma once
// A frame as it was on a CAN bus, for recordings.

#include <array>
#include <cstdint>

#include "io/run_clock.hpp"

namespace hil::io::can {

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

}  // namespace hil::io::can
