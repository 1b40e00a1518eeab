#pragma once
// The identifier of a message as a user writes it: "0x1A5". As in the logs of candump, up to three digits are
// an identifier of 11 bits, and more are one of 29 bits.
//
// Threads: any.

#include <linux/can.h>

#include <charconv>
#include <optional>
#include <string_view>

namespace hil::io::can {

/// With CAN_EFF_FLAG for 29 bits. Empty: the text is no identifier.
inline std::optional<canid_t> identifier_in(std::string_view text) {
  if (!text.starts_with("0x")) return std::nullopt;
  const std::string_view digits = text.substr(2);
  canid_t identifier = 0;
  const auto [end, error] = std::from_chars(digits.begin(), digits.end(), identifier, 16);
  if (error != std::errc{} || end != digits.end()) return std::nullopt;
  const bool is_extended = digits.size() > 3;
  if (identifier > (is_extended ? CAN_EFF_MASK : CAN_SFF_MASK)) return std::nullopt;
  return is_extended ? identifier | CAN_EFF_FLAG : identifier;
}

}  // namespace hil::io::can
