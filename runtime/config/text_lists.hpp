#pragma once
// Words of a sentence, joined to a list.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace hil::config {

/// "a, b and c"; with `conjunction` "or": "a, b or c". Empty: there are no words.
inline std::string text_list(std::span<const std::string> words, std::string_view conjunction = "and") {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool is_last = i + 1 == words.size();
    if (i > 0 && is_last) text.append(" ").append(conjunction).append(" ");
    if (i > 0 && !is_last) text.append(", ");
    text += words[i];
  }
  return text;
}

}  // namespace hil::config
