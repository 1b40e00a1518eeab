#pragma once
// The packets between the hub and the stations of a virtual CAN bus, each one of a SOCK_SEQPACKET socket.
//
//   16 bytes  struct can_frame     a classic frame, as the kernel lays it out
//   72 bytes  struct canfd_frame   an FD frame
//   32 bytes  TimePacket           lock-step only
//   64 bytes  HelloPacket          the first packet of a station
//
// Lock-step: the hub begins a step with `now` (the run time of everything that follows), sends frames, and
// then `barrier`. The station answers the barrier with `ack` and the same sequence number when its
// application calls receive() again; what the application sent before is then already in the socket.

#include <linux/can.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "io/can/frame.hpp"
#include "io/device.hpp"

namespace hil::io::virtual_bus {

struct TimePacket {
  static constexpr std::uint32_t expected_magic = 0x54'4C'49'48;  // "HILT"
  enum class Kind : std::uint32_t { now = 1, barrier = 2, ack = 3 };

  std::uint32_t magic = expected_magic;
  Kind kind = Kind::now;
  std::uint64_t sequence = 0;
  RunTimeNs run_time_ns = 0;
  std::uint64_t reserved = 0;
};
static_assert(sizeof(TimePacket) == 32);

struct HelloPacket {
  static constexpr std::uint32_t expected_magic = 0x48'4C'49'48;  // "HILH"
  static constexpr std::size_t longest_name = 55;

  std::uint32_t magic = expected_magic;
  std::uint32_t version = 1;
  std::array<char, longest_name + 1> name{};  ///< ends with a zero byte
};
static_assert(sizeof(HelloPacket) == 64);

/// Holds every packet, and one byte more to detect a longer one.
using PacketBuffer = std::array<std::uint8_t, CANFD_MTU + 1>;

/// Empty: not a frame (another size, or an invalid length).
inline std::optional<can::Frame> frame_of(const PacketBuffer& packet, std::size_t size) noexcept {
  if (size != CAN_MTU && size != CANFD_MTU) return std::nullopt;
  can::Frame frame;
  std::memcpy(&frame.raw, packet.data(), size);
  frame.is_fd = size == CANFD_MTU;
  if (!frame.is_fd) frame.raw.flags = 0;
  if (!can::valid_length(frame.raw.len, frame.is_fd)) return std::nullopt;
  return frame;
}

inline std::optional<TimePacket> time_packet_of(const PacketBuffer& packet, std::size_t size) noexcept {
  TimePacket result;
  if (size != sizeof result) return std::nullopt;
  std::memcpy(&result, packet.data(), size);
  if (result.magic != TimePacket::expected_magic) return std::nullopt;
  return result;
}

/// The name in the packet; empty optional: not a hello packet of a known version.
inline std::optional<std::string> hello_name_of(const PacketBuffer& packet, std::size_t size) {
  HelloPacket hello;
  if (size != sizeof hello) return std::nullopt;
  std::memcpy(&hello, packet.data(), size);
  if (hello.magic != HelloPacket::expected_magic || hello.version != 1) return std::nullopt;
  return std::string(hello.name.data(), ::strnlen(hello.name.data(), HelloPacket::longest_name));
}

inline HelloPacket hello_from(std::string_view name) noexcept {
  HelloPacket hello;
  std::memcpy(hello.name.data(), name.data(), std::min(name.size(), HelloPacket::longest_name));
  return hello;
}

/// The path of a bus address "unix:/path"; empty optional: another kind of address.
inline std::optional<std::string> unix_path_of(std::string_view address) {
  constexpr std::string_view scheme = "unix:";
  if (!address.starts_with(scheme) || address.size() == scheme.size()) return std::nullopt;
  return std::string(address.substr(scheme.size()));
}

}  // namespace hil::io::virtual_bus
