#pragma once
// Seeded changes to a text, as slips of a user's hand and damaged files make them.

#include <cstdint>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <utility>

namespace hil::tests {

class TextMutator {
 public:
  explicit TextMutator(std::uint64_t seed) : random_(seed) {}

  std::string mutate(std::string text) {
    for (std::uint64_t changes = 1 + random_() % 4; changes > 0; --changes)
      change(text);
    return text;
  }

 private:
  std::size_t below(std::size_t limit) { return limit == 0 ? 0 : random_() % limit; }

  void change(std::string& text) {
    static constexpr std::string_view pieces[] = {
        "[",   "]",   "{",  "}",        ": ",   "- ",    "\n",    "  ",
        "#",   "&a ", "*a", "!!x",      "<<: ", "\"",    "'",     "|",
        ">",   "%",   "\t", "---",      "~",    "yes",   "1e400", ".nan",
        "010", "-1",  "0",  "\xC3\xA4", "\xFF", "{can.", "and",   "9999999999999999999"};
    const std::size_t at = below(text.size() + 1);
    switch (random_() % 7) {
      case 0:
        text.insert(at, pieces[below(std::size(pieces))]);
        break;
      case 1:
        text.erase(at, below(12));
        break;
      case 2:
        text.insert(at, text.substr(below(text.size()), below(60)));
        break;
      case 3:
        if (at < text.size()) text[at] = static_cast<char>(random_());
        break;
      case 4:
        swap_lines(text);
        break;
      case 5:
        text.erase(text.find('\n', at) == std::string::npos ? at : text.find('\n', at), 1);
        break;
      default:
        text.resize(at > text.size() / 2 ? at : text.size());
        break;
    }
  }

  void swap_lines(std::string& text) {
    const auto line_at = [&](std::size_t from) {
      const std::size_t begin = from == 0 ? 0 : text.rfind('\n', from - 1) + 1;
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      return std::pair(begin, end - begin);
    };
    auto first = line_at(below(text.size()));
    auto second = line_at(below(text.size()));
    if (first.first > second.first) std::swap(first, second);
    if (first.first + first.second > second.first) return;
    const std::string moved = text.substr(second.first, second.second);
    text.replace(second.first, second.second, text.substr(first.first, first.second));
    text.replace(first.first, first.second, moved);
  }

  std::mt19937_64 random_;
};

}  // namespace hil::tests
