#include "runtime/report/text_safety.hpp"

#include <algorithm>
#include <cstdint>

namespace hil::report {
namespace {

constexpr std::string_view replacement = "\xEF\xBF\xBD";

struct Character {
  std::uint32_t code = 0;
  std::size_t length = 0;  ///< 0: not UTF-8 here
};

bool is_continuation(unsigned char byte) {
  return (byte & 0xC0U) == 0x80U;
}

/// The character that starts `bytes`. Overlong forms, surrogates and codes past U+10FFFF are not UTF-8.
Character first_character(std::string_view bytes) {
  const auto lead = static_cast<unsigned char>(bytes.front());
  if (lead < 0x80U) return {lead, 1};
  const std::size_t length = lead >= 0xF0U ? 4 : lead >= 0xE0U ? 3 : 2;
  if (lead < 0xC2U || lead > 0xF4U || bytes.size() < length) return {};
  std::uint32_t code = lead & (0xFFU >> (length + 1));
  for (std::size_t index = 1; index < length; ++index) {
    const auto byte = static_cast<unsigned char>(bytes[index]);
    if (!is_continuation(byte)) return {};
    code = (code << 6U) | (byte & 0x3FU);
  }
  const bool overlong = (length == 3 && code < 0x800U) || (length == 4 && code < 0x10000U);
  const bool surrogate = code >= 0xD800U && code <= 0xDFFFU;
  if (overlong || surrogate || code > 0x10FFFFU) return {};
  return {code, length};
}

bool is_allowed(std::uint32_t code) {
  if (code < 0x20U) return code == '\t' || code == '\n' || code == '\r';
  if (code >= 0x7FU && code <= 0x9FU) return false;
  return code != 0xFFFEU && code != 0xFFFFU;
}

/// `bytes` with a replacement for each character for which `keep` is false, and for each byte that is not
/// UTF-8.
template <class Keep>
std::string filtered(std::string_view bytes, Keep keep) {
  std::string out;
  out.reserve(bytes.size());
  while (!bytes.empty()) {
    const Character character = first_character(bytes);
    const std::size_t length = std::max<std::size_t>(character.length, 1);
    out += character.length > 0 && keep(character.code) ? bytes.substr(0, length) : replacement;
    bytes.remove_prefix(length);
  }
  return out;
}

}  // namespace

std::string valid_utf8(std::string_view bytes) {
  return filtered(bytes, [](std::uint32_t) { return true; });
}

std::string clean_text(std::string_view bytes) {
  return filtered(bytes, is_allowed);
}

std::string escape_markup(std::string_view bytes) {
  std::string out;
  for (const char character : clean_text(bytes)) {
    switch (character) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      case '\t':
        out += "&#9;";
        break;
      case '\n':
        out += "&#10;";
        break;
      case '\r':
        out += "&#13;";
        break;
      default:
        out += character;
    }
  }
  return out;
}

std::string one_line(std::string_view bytes) {
  std::string out = clean_text(bytes);
  std::ranges::replace_if(
      out, [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return out;
}

std::size_t columns_of(std::string_view utf8) {
  return static_cast<std::size_t>(
      std::ranges::count_if(utf8, [](char c) { return !is_continuation(static_cast<unsigned char>(c)); }));
}

}  // namespace hil::report
