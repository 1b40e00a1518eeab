#pragma once
// CRC-8 SAE J1850: polynomial 0x1D, start value 0xFF, final XOR 0xFF, most significant bit first.
// Over the nine ASCII characters "123456789" it is 0x4B.
//
// The checksum of a message is this CRC over, in this order: the low byte of the message's identifier (so
// that a payload under the wrong identifier is noticed), then every byte of the payload with the bits of the
// checksum signal itself zero.
//
// Pure functions; any thread.

#include <array>
#include <cstdint>
#include <span>

#include "io/can/signal_codec.hpp"

namespace hil::io::can {

namespace detail {
constexpr std::array<std::uint8_t, 256> crc8_table() {
  std::array<std::uint8_t, 256> table{};
  for (unsigned value = 0; value < 256; ++value) {
    unsigned crc = value;
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc & 0x80U) != 0 ? (crc << 1U) ^ 0x1DU : crc << 1U;
    table[value] = static_cast<std::uint8_t>(crc);
  }
  return table;
}
inline constexpr std::array<std::uint8_t, 256> crc8_steps = crc8_table();
}  // namespace detail

class Crc8 {
 public:
  void add(std::uint8_t byte) noexcept { state_ = detail::crc8_steps[state_ ^ byte]; }
  std::uint8_t value() const noexcept { return state_ ^ 0xFFU; }

 private:
  std::uint8_t state_ = 0xFF;
};

inline std::uint8_t crc8_sae_j1850(std::span<const std::uint8_t> bytes) noexcept {
  Crc8 crc;
  for (const std::uint8_t byte : bytes)
    crc.add(byte);
  return crc.value();
}

/// As defined at the top. `checksum` is the 8-bit signal that contains it; payloads have at most 64 bytes.
inline std::uint8_t message_checksum(std::uint32_t identifier, std::span<const std::uint8_t> payload,
                                     const SignalCodec& checksum) noexcept {
  std::array<std::uint8_t, 64> cleared{};
  for (std::size_t index = 0; index < payload.size(); ++index)
    cleared[index] = payload[index];
  checksum.insert(std::span(cleared).first(payload.size()), 0);
  Crc8 crc;
  crc.add(static_cast<std::uint8_t>(identifier & 0xFFU));
  for (std::size_t index = 0; index < payload.size(); ++index)
    crc.add(cleared[index]);
  return crc.value();
}

}  // namespace hil::io::can
