#pragma once
// Enumerators and the words that stand for them in files.

#include <array>
#include <cstddef>
#include <optional>
#include <string>

namespace hil::contribution {

/// The enumerator whose word, by its value, is `word`.
template <class Enum, std::size_t Count>
std::optional<Enum> enumerator_of(const std::array<const char*, Count>& words, const std::string& word) {
  for (std::size_t index = 0; index < Count; ++index) {
    if (word == words[index]) return static_cast<Enum>(index);
  }
  return std::nullopt;
}

}  // namespace hil::contribution
