#include <hil/section.hpp>

#include "runtime/contract/words.hpp"

namespace hil::contribution {
namespace {

constexpr std::array mark_words{"none", "good", "bad"};

}  // namespace

const char* to_string(Mark mark) noexcept {
  return mark_words[static_cast<std::size_t>(mark)];
}

std::optional<Mark> mark_from(const std::string& word) {
  return enumerator_of<Mark>(mark_words, word);
}

}  // namespace hil::contribution
