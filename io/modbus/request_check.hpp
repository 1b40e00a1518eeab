#pragma once
// Requests as they arrive at a server, checked byte by byte before libmodbus sees them: 3.1.6 trusts the
// lengths and counts inside a request, sleeps through its response time-out when it refuses one, and has no
// answer to function 7.
//
// Threads: free functions on values, callable from any thread. No allocation.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "io/modbus/register_bank.hpp"

namespace hil::io::modbus {

/// Header of a Modbus TCP frame: transaction id (2), protocol id (2), length (2, of what follows it), unit id
/// (1).
inline constexpr std::size_t header_size = 7;
/// The longest frame: header and a protocol data unit of 253 bytes.
inline constexpr std::size_t longest_frame = 260;

enum class Framing : std::uint8_t {
  incomplete,  ///< more bytes have to come
  complete,    ///< the first `size` bytes are a frame
  hopeless,  ///< no Modbus TCP: another protocol id, or a length that no frame has; where the next one starts
             ///< is unknown
};

struct FramingResult {
  Framing framing = Framing::incomplete;
  std::size_t size = 0;
};

FramingResult find_frame(std::span<const std::uint8_t> bytes) noexcept;

/// 0: the request is sound. Else the exception to answer it with: 1 unknown function, 2 an address that is
/// not there or not to be written, 3 a count or length that the function does not allow. `frame` is a
/// complete frame.
std::uint8_t check_request(std::span<const std::uint8_t> frame, const RegisterBank& bank) noexcept;

struct WrittenRange {
  Table table = Table::holding;
  std::uint16_t address = 0;
  std::uint16_t count = 0;
};

/// What a sound request writes. Empty: the request only reads.
std::optional<WrittenRange> written_range(std::span<const std::uint8_t> frame) noexcept;

/// Carries out the writing part of a sound request. Empty: the request only reads.
std::optional<WrittenRange> apply_writes(std::span<const std::uint8_t> frame, RegisterBank& bank) noexcept;

}  // namespace hil::io::modbus
