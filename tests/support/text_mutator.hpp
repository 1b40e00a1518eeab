#pragma once
// Random changes to a text from a seed: typing mistakes and damage.

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
    static constexpr std::string_view numbers[] = {
        "0",   "1",          "-1",    "64",     "65",    "255",    "65536",
        "1e9", "4294967296", "0.001", "1e-300", "1e308", "-1e308", "9223372036854775808"};
    const std::size_t at = below(text.size() + 1);
    switch (random_() % 10) {
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
      case 6:
        text.resize(at > text.size() / 2 ? at : text.size());
        break;
      // These keep the syntax, so that they reach the code behind the parsers.
      case 7:
      case 8:
        replace(text, part(text, is_digit), numbers[below(std::size(numbers))]);
        break;
      default: {
        const Part other = part(text, is_letter);
        replace(text, part(text, is_letter), text.substr(other.at, other.length));
      }
    }
  }

  struct Part {
    std::size_t at = 0;
    std::size_t length = 0;
  };
  static bool is_digit(char letter) { return letter >= '0' && letter <= '9'; }
  static bool is_letter(char letter) {
    return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') || letter == '_';
  }
  /// The first run of matching characters from a random place on; empty when there is none.
  Part part(const std::string& text, bool (*matches)(char)) {
    std::size_t begin = below(text.size());
    while (begin < text.size() && !matches(text[begin]))
      ++begin;
    std::size_t end = begin;
    while (end < text.size() && matches(text[end]))
      ++end;
    return {begin, end - begin};
  }
  static void replace(std::string& text, Part part, std::string_view by) {
    text.replace(part.at, part.length, by);
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
