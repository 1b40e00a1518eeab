#pragma once
// Reads a DBC text token by token. Positions are byte offsets; lines and columns are worked out only for
// problems.

#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

namespace hil::io::can {

class DbcScanner {
 public:
  explicit DbcScanner(std::string_view text) : text_(text) {}

  std::size_t position() const noexcept { return position_; }
  void move_to(std::size_t position) noexcept { position_ = position; }
  bool at_end() const noexcept { return position_ >= text_.size(); }

  void skip_space() noexcept {
    while (position_ < text_.size() && is_space(text_[position_]))
      ++position_;
  }
  void skip_blanks_in_line() noexcept {
    while (position_ < text_.size() && text_[position_] != '\n' && is_space(text_[position_]))
      ++position_;
  }
  void skip_line() noexcept {
    const void* end = std::memchr(text_.data() + position_, '\n', text_.size() - position_);
    position_ = end == nullptr ? text_.size() : static_cast<const char*>(end) - text_.data() + 1;
  }
  bool at_line_end() noexcept {
    skip_blanks_in_line();
    return at_end() || text_[position_] == '\n';
  }

  char peek() noexcept {
    skip_space();
    return at_end() ? '\0' : text_[position_];
  }
  bool accept(char wanted) noexcept {
    if (peek() != wanted || at_end()) return false;
    ++position_;
    return true;
  }

  /// A C identifier; empty when there is none here.
  std::string_view identifier() noexcept {
    skip_space();
    if (at_end() || !is_word_start(text_[position_])) return {};
    const std::size_t begin = position_;
    while (position_ < text_.size() && is_word(text_[position_]))
      ++position_;
    return text_.substr(begin, position_ - begin);
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

  /// A string in double quotes, which may span lines; `\"` is a quote. Empty optional: none here, or never
  /// closed.
  std::optional<std::string_view> quoted() noexcept {
    if (!accept('"')) return std::nullopt;
    const std::size_t begin = position_;
    if (futile_bytes_ > futile_limit()) {
      position_ = begin - 1;
      return std::nullopt;
    }
    for (std::size_t at = begin; at < text_.size(); ++at) {
      if (text_[at] == '\\' && at + 1 < text_.size() && text_[at + 1] == '"') {
        ++at;
      } else if (text_[at] == '"') {
        position_ = at + 1;
        return text_.substr(begin, at - begin);
      }
    }
    futile_bytes_ += text_.size() - begin;
    position_ = begin - 1;
    return std::nullopt;
  }

  /// Passes the `;` that ends the statement. False when the text ends first; the position then stays.
  bool skip_statement() noexcept {
    if (futile_bytes_ > futile_limit()) return false;
    for (std::size_t at = position_; at < text_.size(); ++at) {
      if (text_[at] == ';') {
        position_ = at + 1;
        return true;
      }
      if (text_[at] != '"') continue;
      const std::size_t before = position_;
      position_ = at;
      if (!quoted()) {
        position_ = before;
        return false;
      }
      at = position_ - 1;
      position_ = before;
    }
    futile_bytes_ += text_.size() - position_;
    return false;
  }

 private:
  static bool is_space(char c) noexcept { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
  static bool is_word_start(char c) noexcept {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  }
  static bool is_word(char c) noexcept { return is_word_start(c) || (c >= '0' && c <= '9'); }

  /// Searches for an end that is not there read to the end of the text. After this many bytes of them the
  /// text is hopeless and further searches fail at once, so that no input takes more than linear time.
  std::size_t futile_limit() const noexcept { return 4 * text_.size(); }

  std::string_view text_;
  std::size_t position_ = 0;
  std::size_t futile_bytes_ = 0;
};

/// Offset -> line and column, cheap when asked in rising order.
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
    }
    while (true) {
      const void* end = std::memchr(text_.data() + line_start_, '\n', offset - line_start_);
      if (end == nullptr) return {line_, offset - line_start_ + 1};
      line_start_ = static_cast<std::size_t>(static_cast<const char*>(end) - text_.data()) + 1;
      ++line_;
    }
  }

 private:
  std::string_view text_;
  std::size_t line_ = 1;
  std::size_t line_start_ = 0;
};

}  // namespace hil::io::can
