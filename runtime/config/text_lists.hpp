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
    if (i > 0) text += i + 1 == words.size() ? " " + std::string(conjunction) + " " : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace hil::config
