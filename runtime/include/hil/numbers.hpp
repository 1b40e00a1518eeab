#pragma once
// Numbers as a user writes them. Decimal point, optional exponent, no digit grouping, no leading zeros (some
// YAML dialects read 010 as eight), no infinities. The locale plays no part.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hil::config {

struct ParsedNumber {
  double value = 0.0;
  std::size_t length = 0;  ///< bytes of the number at the front of the text; what follows is the caller's
  std::string fault;       ///< empty, or a clause that states why it is no number
};

/// The number at the front of `text`, correctly rounded to double. Too large or too small for a double is a
/// fault.
ParsedNumber read_number(std::string_view text);

struct ParsedInteger {
  std::int64_t value = 0;
  std::string fault;
};

/// The whole of `text` as a decimal or 0x... integer.
ParsedInteger read_integer(std::string_view text);

/// A decimal number (as read_number accepts it) times an integer unit, rounded half away from zero: "1.5" *
/// 1'000'000 is exactly 1'500'000. Digits beyond the 18th significant one are dropped. Empty when it does not
/// fit.
std::optional<std::int64_t> multiply_exactly(std::string_view number, std::int64_t unit);

/// Without trailing zeros.
std::string format_number(double value, int significant_digits = 12);

}  // namespace hil::config
