#pragma once
// Text without the blanks around it.

#include <string_view>

namespace hil::config {

/// Without spaces, tabs and carriage returns at both ends. Views the same characters.
inline std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r";
  const auto is_blank = [&](char c) { return blanks.find(c) != std::string_view::npos; };
  while (!text.empty() && is_blank(text.front()))
    text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back()))
    text.remove_suffix(1);
  return text;
}

}  // namespace hil::config
