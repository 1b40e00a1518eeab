#pragma once
// Reads a DBC text token by token. White space, line ends (LF, CR LF, CR) and `//` comments separate tokens
// and have no other meaning; the begin of a line only matters for finding the next statement after a mistake.
// Positions are byte offsets.

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "io/can/dbc_keywords.hpp"

namespace hil::io::can {

class DbcScanner {
 public:
  explicit DbcScanner(std::string_view text) : text_(text) {}

  std::size_t position() const noexcept { return position_; }
  void move_to(std::size_t position) noexcept { position_ = position; }
  bool at_end() const noexcept { return position_ >= text_.size(); }

  /// Moves to the next token, or to the end.
  void skip_space() noexcept {
    while (position_ < text_.size()) {
      if (is_space(text_[position_])) {
        ++position_;
      } else if (text_.substr(position_, 2) == "//") {
        skip_to_line_end();
      } else {
        return;
      }
    }
  }

  /// The first byte of the next token; zero at the end.
  char peek() noexcept {
    skip_space();
    return at_end() ? '\0' : text_[position_];
  }
  bool accept(char wanted) noexcept {
    if (peek() != wanted || at_end()) return false;
    ++position_;
    return true;
  }
  /// Skips one byte of a token that is not a word.
  void skip_byte() noexcept { ++position_; }

  /// A C identifier; empty when there is none here.
  std::string_view identifier() noexcept {
    skip_space();
    if (at_end() || !is_word_start(text_[position_])) return {};
    const std::size_t begin = position_;
    while (position_ < text_.size() && is_word(text_[position_]))
      ++position_;
    return text_.substr(begin, position_ - begin);
  }
  /// The next identifier without consuming it; empty when there is none here.
  std::string_view peek_identifier() noexcept {
    skip_space();
    const std::size_t begin = position_;
    const std::string_view word = identifier();
    position_ = begin;
    return word;
  }

  template <typename Number>
  std::optional<Number> number() noexcept {
    skip_space();
    std::size_t begin = position_;
    if (begin < text_.size() && text_[begin] == '+') ++begin;
    Number value{};
    const char* end = text_.data() + text_.size();
    const auto [stop, fault] = std::from_chars(text_.data() + begin, end, value);
    if (fault != std::errc{}) return std::nullopt;
    position_ = static_cast<std::size_t>(stop - text_.data());
    return value;
  }

  /// A string in double quotes, which may span lines, as written: in it `\"` is a quote and `\\` a backslash.
  /// Empty optional: there is none here, or it is not closed; the position is then unchanged.
  std::optional<std::string_view> quoted() noexcept {
    if (!accept('"')) return std::nullopt;
    const std::size_t begin = position_;
    position_ = begin - 1;
    if (string_bytes_ > string_limit()) return std::nullopt;
    for (std::size_t at = begin; at < text_.size(); ++at) {
      if (text_[at] == '\\' && at + 1 < text_.size() && (text_[at + 1] == '"' || text_[at + 1] == '\\')) {
        ++at;
      } else if (text_[at] == '"') {
        string_bytes_ += at - begin;
        position_ = at + 1;
        return text_.substr(begin, at - begin);
      }
    }
    string_bytes_ += text_.size() - begin;
    return std::nullopt;
  }

  /// True when the next token is the first of its line.
  bool is_first_in_line() noexcept {
    skip_space();
    std::size_t before = position_;
    while (before > 0 && is_blank(text_[before - 1]))
      --before;
    return before == 0 || is_line_end(text_[before - 1]);
  }
  /// True when the next token is the first of its line and begins a statement.
  bool at_statement_line() noexcept { return is_first_in_line() && is_dbc_keyword(peek_identifier()); }

  /// Moves to the next line after `from` that begins with a keyword, or to the end.
  void skip_to_statement_line(std::size_t from) noexcept {
    position_ = from;
    do {
      skip_to_line_end();
    } while (!at_statement_line() && !at_end());
  }

 private:
  static bool is_blank(char c) noexcept { return c == ' ' || c == '\t'; }
  static bool is_line_end(char c) noexcept { return c == '\n' || c == '\r'; }
  static bool is_space(char c) noexcept { return is_blank(c) || is_line_end(c) || c == '\v' || c == '\f'; }
  static bool is_word_start(char c) noexcept {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  }
  static bool is_word(char c) noexcept { return is_word_start(c) || (c >= '0' && c <= '9'); }

  void skip_to_line_end() noexcept {
    while (position_ < text_.size() && !is_line_end(text_[position_]))
      ++position_;
  }

  /// When a statement that contains strings fails, the parser reads the strings again. After this many bytes
  /// of strings the text counts as damaged and further strings fail at once, so that parsing takes linear
  /// time.
  std::size_t string_limit() const noexcept { return 4 * text_.size(); }

  std::string_view text_;
  std::size_t position_ = 0;
  std::size_t string_bytes_ = 0;
};

/// Converts offsets to line and column. Fast for ascending offsets.
class LineCounter {
 public:
  explicit LineCounter(std::string_view text) : text_(text) {}

  struct Place {
    std::size_t line = 1;
    std::size_t column = 1;
  };
  Place place_of(std::size_t offset) noexcept {
    if (offset < line_start_) {
      line_ = 1;
      line_start_ = 0;
      next_ = 0;
    }
    for (; next_ < std::min(offset, text_.size()); ++next_) {
      const bool is_first_of_pair =
          text_[next_] == '\r' && next_ + 1 < text_.size() && text_[next_ + 1] == '\n';
      if ((text_[next_] != '\n' && text_[next_] != '\r') || is_first_of_pair) continue;
      line_start_ = next_ + 1;
      ++line_;
    }
    return {line_, offset - line_start_ + 1};
  }

 private:
  std::string_view text_;
  std::size_t line_ = 1;
  std::size_t line_start_ = 0;
  std::size_t next_ = 0;  ///< the lines before this offset are counted
};

}  // namespace hil::io::can
