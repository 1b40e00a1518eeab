#include <hil/map.hpp>

#include "runtime/contract/words.hpp"

namespace hil::contribution {
namespace {

constexpr std::array layer_words{"ground", "road", "marking", "detector", "static", "pole", "vehicle", "ego"};

}  // namespace

const char* to_string(Layer layer) noexcept {
  return layer_words[static_cast<std::size_t>(layer)];
}

std::optional<Layer> layer_from(const std::string& word) {
  return enumerator_of<Layer>(layer_words, word);
}

}  // namespace hil::contribution
