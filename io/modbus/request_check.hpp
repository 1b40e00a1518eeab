#pragma once
// Checks requests that arrive at a server byte by byte before libmodbus processes them. libmodbus 3.1.6
// trusts the lengths and counts in a request, sleeps for its response timeout when it refuses one, and does
// not answer function 7.
//
// Threads: free functions on values, callable from any thread. No allocation.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "io/modbus/register_bank.hpp"

namespace hil::io::modbus {

/// Header of a Modbus TCP frame: transaction id (2), protocol id (2), length of the rest (2), unit id (1).
inline constexpr std::size_t header_size = 7;
/// The longest frame: the header and a protocol data unit of 253 bytes.
inline constexpr std::size_t longest_frame = 260;

enum class Framing : std::uint8_t {
  incomplete,  ///< more bytes are needed
  complete,    ///< the first `size` bytes are a frame
  /// Not Modbus TCP: another protocol id, or a length that no frame has. The begin of the next frame is
  /// unknown.
  invalid,
};

struct FramingResult {
  Framing framing = Framing::incomplete;
  std::size_t size = 0;
};

FramingResult find_frame(std::span<const std::uint8_t> bytes) noexcept;

/// Returns 0 for a valid request, otherwise the exception to answer with: 1 unknown function, 2 an address
/// that does not exist or may not be written, 3 a count or length that the function does not allow. `frame`
/// is a complete frame.
std::uint8_t check_request(std::span<const std::uint8_t> frame, const RegisterBank& bank) noexcept;

/// The range that a request reads, or, if it also writes, the one that it writes. `frame` is a complete
/// frame, whose addresses need not exist. Empty: the function has no range, or the frame
/// is too short.
std::optional<RequestRange> requested_range(std::span<const std::uint8_t> frame) noexcept;

/// The range that a valid request writes; empty: it only reads.
std::optional<RequestRange> written_range(std::span<const std::uint8_t> frame) noexcept;

/// Applies the writes of a valid request; empty: it only reads.
std::optional<RequestRange> apply_writes(std::span<const std::uint8_t> frame, RegisterBank& bank) noexcept;

}  // namespace hil::io::modbus
