#pragma once
// One CAN frame in the kernel's layout, with its time and direction.
//
// Plain values; any thread.

#include <linux/can.h>

#include <cstdint>
#include <cstring>
#include <span>

#include "io/can/assertion.hpp"
#include "io/device.hpp"

namespace hil::io::can {

enum class Direction : std::uint8_t {
  rx,  ///< from another station
  tx,  ///< sent by this station, seen on the bus
};

struct Frame {
  /// Classic and FD frames share this layout: identifier with its flag bits, length, data at offset 8.
  canfd_frame raw{};
  bool is_fd =
      false;  ///< FD frame on the wire; classic frames have at most 8 bytes and may be remote requests
  Direction direction = Direction::rx;
  RunTimeNs time_ns =
      0;  ///< run time at which the frame was on the bus (kernel timestamp where there is one)
  std::int64_t wall_ns =
      0;  ///< the same instant as nanoseconds since 1970; under the virtual clock equal to time_ns
  bool is_altered = false;       ///< a fault of the bus or of its message changed it
  bool is_sender_wrong = false;  ///< its device would reject it without the faults of the scenario
  /// By fault injection of a bus, or since a log begins anew: its counter need not continue that of the frame
  /// of its identifier before it.
  bool is_discontinuous = false;

  bool is_error() const noexcept { return (raw.can_id & CAN_ERR_FLAG) != 0; }
  bool is_remote() const noexcept { return !is_fd && (raw.can_id & CAN_RTR_FLAG) != 0; }
  bool is_extended() const noexcept { return (raw.can_id & CAN_EFF_FLAG) != 0; }
  /// 11 or 29 bits, without flags.
  canid_t identifier() const noexcept { return raw.can_id & (is_extended() ? CAN_EFF_MASK : CAN_SFF_MASK); }
  std::span<const std::uint8_t> payload() const noexcept { return {raw.data, raw.len}; }
  /// Bytes of the kernel's struct for this frame: CAN_MTU or CANFD_MTU.
  std::size_t struct_size() const noexcept { return is_fd ? CANFD_MTU : CAN_MTU; }

  /// Same identifier, flags, kind and payload. Times and direction are not part of a frame's content.
  bool same_content(const Frame& other) const noexcept {
    return raw.can_id == other.raw.can_id && raw.len == other.raw.len && is_fd == other.is_fd &&
           (!is_fd || raw.flags == other.raw.flags) && std::memcmp(raw.data, other.raw.data, raw.len) == 0;
  }
};

/// True for lengths that a frame of this kind can have: 0..8, and for FD also 12, 16, 20, 24, 32, 48, 64.
constexpr bool valid_length(std::size_t length, bool is_fd) noexcept {
  if (length <= CAN_MAX_DLEN) return true;
  if (!is_fd) return false;
  return length == 12 || length == 16 || length == 20 || length == 24 || length == 32 || length == 48 ||
         length == 64;
}

/// A data frame to send. `can_id` carries CAN_EFF_FLAG for 29-bit identifiers. Misuse (asserts): a length
/// that the kind of frame can not have.
inline Frame make_frame(canid_t can_id, std::span<const std::uint8_t> payload, bool is_fd = false) {
  require(valid_length(payload.size(), is_fd), "a frame's payload has a length that CAN can carry");
  Frame frame;
  frame.raw.can_id = can_id;
  frame.raw.len = static_cast<std::uint8_t>(payload.size());
  if (!payload.empty()) std::memcpy(frame.raw.data, payload.data(), payload.size());
  frame.is_fd = is_fd;
  return frame;
}

/// Bits of the frame on the wire at nominal bit rate, with interframe space and without stuff bits. For bus
/// load.
constexpr std::uint32_t wire_bits(const Frame& frame) noexcept {
  const std::uint32_t overhead = (frame.raw.can_id & CAN_EFF_FLAG) != 0 ? 67 : 47;
  const bool has_data = frame.is_fd || (frame.raw.can_id & CAN_RTR_FLAG) == 0;
  return overhead + (has_data ? 8U * frame.raw.len : 0U);
}

}  // namespace hil::io::can
