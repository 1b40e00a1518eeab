#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <limits>
#include <system_error>

#include <hil/numbers.hpp>

namespace hil::config {
namespace {

__extension__ using WideInteger = __int128;

bool is_digit(char letter) {
  return letter >= '0' && letter <= '9';
}

/// A number's parts, as text.
struct Parts {
  bool negative = false;
  std::string_view whole;
  std::string_view fraction;
  std::string_view exponent;  ///< with its sign
  std::size_t length = 0;     ///< 0: not a number
};

std::size_t digits_at(std::string_view text, std::size_t begin) {
  std::size_t end = begin;
  while (end < text.size() && is_digit(text[end]))
    ++end;
  return end - begin;
}

Parts split(std::string_view text) {
  Parts parts;
  std::size_t at = 0;
  if (!text.empty() && (text[0] == '+' || text[0] == '-')) {
    parts.negative = text[0] == '-';
    at = 1;
  }
  parts.whole = text.substr(std::min(at, text.size()), digits_at(text, at));
  at += parts.whole.size();
  if (at < text.size() && text[at] == '.') {
    parts.fraction = text.substr(at + 1, digits_at(text, at + 1));
    at += 1 + parts.fraction.size();
  }
  if (parts.whole.empty() && parts.fraction.empty()) return {};
  parts.length = at;
  if (at < text.size() && (text[at] == 'e' || text[at] == 'E')) {
    const std::size_t sign = at + 1 < text.size() && (text[at + 1] == '+' || text[at + 1] == '-') ? 1 : 0;
    const std::size_t digits = digits_at(text, at + 1 + sign);
    if (digits > 0) {
      parts.exponent = text.substr(at + 1, sign + digits);
      parts.length = at + 1 + sign + digits;
    }
  }
  return parts;
}

/// The exponent as an integer, held within what can matter.
std::int64_t exponent_of(const Parts& parts) {
  constexpr std::int64_t far = 1'000'000'000;
  std::string_view text = parts.exponent;
  const bool negative = text.starts_with('-');
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  std::int64_t value = 0;
  for (const char digit : text)
    value = std::min(far, value * 10 + (digit - '0'));
  return negative ? -value : value;
}

/// Power of ten of the first digit that is not zero.
std::int64_t magnitude_of(const Parts& parts) {
  const std::size_t in_whole = parts.whole.find_first_not_of('0');
  if (in_whole != std::string_view::npos) {
    return static_cast<std::int64_t>(parts.whole.size() - in_whole) - 1 + exponent_of(parts);
  }
  const std::size_t in_fraction = std::min(parts.fraction.find_first_not_of('0'), parts.fraction.size());
  return exponent_of(parts) - static_cast<std::int64_t>(in_fraction) - 1;
}

bool names_no_finite_number(std::string_view text) {
  std::string word;
  for (const char letter : text) {
    if (letter == '+' || letter == '-' || letter == '.') continue;
    word += letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
    if (word.size() > 8) break;
  }
  return word == "nan" || word == "inf" || word == "infinity";
}

}  // namespace

ParsedNumber read_number(std::string_view text) {
  ParsedNumber reading;
  const Parts parts = split(text);
  if (parts.length == 0) {
    reading.fault = names_no_finite_number(text) ? "is not a finite number" : "is not a number";
    return reading;
  }
  reading.length = parts.length;
  if (parts.whole.size() > 1 && parts.whole[0] == '0') {
    reading.fault = "has a leading zero, which some read as octal; leave it out";
    return reading;
  }
  std::string_view digits = text.substr(0, parts.length);
  if (digits[0] == '+') digits.remove_prefix(1);
  const std::from_chars_result result =
      std::from_chars(digits.data(), digits.data() + digits.size(), reading.value);
  if (result.ec == std::errc::result_out_of_range) {
    reading.fault = magnitude_of(parts) > 0 ? "is too large to be held" : "is too close to zero to be held";
  } else if (result.ec != std::errc() || result.ptr != digits.data() + digits.size()) {
    reading.fault = "is not a number";
  }
  return reading;
}

ParsedInteger read_integer(std::string_view text) {
  ParsedInteger reading;
  std::string_view digits = text;
  const bool negative = digits.starts_with('-');
  if (negative || digits.starts_with('+')) digits.remove_prefix(1);
  const bool hexadecimal = digits.starts_with("0x") || digits.starts_with("0X");
  if (hexadecimal) digits.remove_prefix(2);
  if (digits.empty() || digits[0] == '+' || digits[0] == '-') {
    reading.fault = "is not a whole number";
    return reading;
  }
  if (!hexadecimal && digits.size() > 1 && digits[0] == '0' && digits_at(digits, 0) == digits.size()) {
    reading.fault = "has a leading zero, which some read as octal; leave it out";
    return reading;
  }
  // The sign goes with the digits, since the most negative value has no positive twin.
  std::string written(negative ? 1 : 0, '-');
  written += digits;
  const char* const end = written.data() + written.size();
  const std::from_chars_result result =
      std::from_chars(written.data(), end, reading.value, hexadecimal ? 16 : 10);
  if (result.ptr != end || result.ec == std::errc::invalid_argument) {
    reading.fault = "is not a whole number";
  } else if (result.ec == std::errc::result_out_of_range) {
    reading.fault = "does not fit into 64 bits";
  }
  return reading;
}

std::optional<std::int64_t> multiply_exactly(std::string_view number, std::int64_t unit) {
  constexpr std::size_t max_digits = 18;
  const Parts parts = split(number);
  if (parts.length != number.size() || number.empty()) return std::nullopt;
  std::string digits = std::string(parts.whole) + std::string(parts.fraction);
  std::int64_t exponent = exponent_of(parts) - static_cast<std::int64_t>(parts.fraction.size());
  digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
  if (digits.size() > max_digits) {
    exponent += static_cast<std::int64_t>(digits.size() - max_digits);
    digits.resize(max_digits);
  }
  WideInteger product = 0;
  for (const char digit : digits)
    product = product * 10 + (digit - '0');
  product *= unit;
  constexpr WideInteger most = std::numeric_limits<std::int64_t>::max();
  for (; exponent > 0 && product != 0; --exponent) {
    if (product > most) return std::nullopt;
    product *= 10;
  }
  bool rounds_up = false;
  for (; exponent < 0 && (product != 0 || rounds_up); ++exponent) {
    rounds_up = product % 10 >= 5;
    product /= 10;
  }
  if (rounds_up) product += 1;
  if (product > most) return std::nullopt;
  return static_cast<std::int64_t>(parts.negative ? -product : product);
}

std::string format_number(double value, int significant_digits) {
  std::array<char, 40> text{};
  const int length = std::snprintf(text.data(), text.size(), "%.*g", significant_digits, value);
  std::string written(text.data(), static_cast<std::size_t>(length));
  std::replace(written.begin(), written.end(), ',', '.');  // a locale's decimal comma
  return written;
}

}  // namespace hil::config
