#include "rtstdb/geometry/json.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace rtstdb {
namespace json {
namespace {

constexpr double largest_whole = 9007199254740992.0;  // 2^53

class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  JsonValue read() {
    JsonValue value = next();
    skip_blanks();
    if (at_ < text_.size() && text_[at_] != '\0') refuse("the end");  // a chunk of a GLB file may be padded
    return value;
  }

 private:
  [[noreturn]] void refuse(const char* wanted) const {
    throw std::runtime_error("its JSON is damaged at byte " + std::to_string(at_) + ", where " + wanted +
                             " is due");
  }
  void skip_blanks() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos)
      ++at_;
  }
  bool take(char wanted) {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }
  bool take_word(std::string_view word) {
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }

  JsonValue next() {
    skip_blanks();
    JsonValue value;
    if (take('{')) {
      value.kind = JsonValue::Kind::object;
      read_members(value);
    } else if (take('[')) {
      value.kind = JsonValue::Kind::array;
      read_items(value);
    } else if (at_ < text_.size() && text_[at_] == '"') {
      value.kind = JsonValue::Kind::string;
      value.text = string();
    } else if (take_word("true")) {
      value.kind = JsonValue::Kind::boolean;
      value.number = 1.0;
    } else if (take_word("false")) {
      value.kind = JsonValue::Kind::boolean;
    } else if (!take_word("null")) {
      value.kind = JsonValue::Kind::number;
      value.number = number();
    }
    return value;
  }
  void read_members(JsonValue& object) {
    if (take('}')) return;
    do {
      skip_blanks();
      std::string name = string();
      if (!take(':')) refuse("':'");
      object.members.emplace_back(std::move(name), next());
    } while (take(','));
    if (!take('}')) refuse("',' or '}'");
  }
  void read_items(JsonValue& array) {
    if (take(']')) return;
    do {
      array.items.push_back(next());
    } while (take(','));
    if (!take(']')) refuse("',' or ']'");
  }
  std::string string() {
    if (!take('"')) refuse("a string");
    std::string text;
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] != '\\') {
        // In pieces: a buffer may stand in one string.
        const std::size_t end = std::min(text_.find_first_of("\"\\", at_), text_.size());
        text.append(text_.substr(at_, end - at_));
        at_ = end;
        continue;
      }
      if (at_ + 1 == text_.size()) break;
      constexpr std::string_view escaped = "bfnrt", meant = "\b\f\n\r\t";
      const char c = text_[at_ + 1];
      const std::size_t which = escaped.find(c);
      if (c == 'u') text += '\\';
      text += which == std::string_view::npos ? c : meant[which];
      at_ += 2;
    }
    if (at_ == text_.size()) refuse("the end of a string");
    ++at_;
    return text;
  }
  double number() {
    double value = 0.0;
    const auto [end, fault] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    const bool is_digit =
        at_ < text_.size() && (text_[at_] == '-' || (text_[at_] >= '0' && text_[at_] <= '9'));
    if (fault == std::errc::invalid_argument || !is_digit) refuse("a value");
    at_ = static_cast<std::size_t>(end - text_.data());
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace
}  // namespace json

const JsonValue* JsonValue::find(std::string_view name) const noexcept {
  for (const auto& [key, value] : members)
    if (key == name) return &value;
  return nullptr;
}

const JsonValue* JsonValue::item(std::uint64_t index) const noexcept {
  return index < items.size() ? &items[index] : nullptr;
}

std::optional<std::uint64_t> JsonValue::whole() const noexcept {
  if (kind != Kind::number || !(number >= 0.0 && number <= json::largest_whole)) return std::nullopt;
  const auto value = static_cast<std::uint64_t>(number);
  return static_cast<double>(value) == number ? std::optional(value) : std::nullopt;
}

JsonValue read_json(std::string_view text) {
  return json::Reader(text).read();
}

}  // namespace rtstdb
