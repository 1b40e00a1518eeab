#include "runtime/contract/source_text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

namespace hil::config {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

bool is_continuation(char letter) {
  return (static_cast<unsigned char>(letter) & 0xC0U) == 0x80U;
}
bool is_blank(char letter) {
  return letter == ' ' || letter == '\t' || letter == '\n' || letter == '\r';
}

/// Length of the UTF-8 character at the front of `text`; 0: not one (overlong forms and surrogates included).
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(text[i])); };
  const unsigned lead = byte(0);
  if (lead < 0x80U) return 1;
  const std::size_t length = lead >= 0xF0U ? 4 : lead >= 0xE0U ? 3 : 2;
  if (lead < 0xC2U || lead > 0xF4U || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if (!is_continuation(text[i])) return 0;
  }
  const unsigned second = byte(1);
  if ((lead == 0xE0U && second < 0xA0U) || (lead == 0xEDU && second > 0x9FU)) return 0;
  if ((lead == 0xF0U && second < 0x90U) || (lead == 0xF4U && second > 0x8FU)) return 0;
  return length;
}

bool is_forbidden_control(char letter) {
  const auto byte = static_cast<unsigned char>(letter);
  return (byte < 0x20U && letter != '\t' && letter != '\n' && letter != '\r') || byte == 0x7FU;
}

std::string hexadecimal(char letter) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%02X",
                static_cast<unsigned>(static_cast<unsigned char>(letter)));
  return text.data();
}

bool check_characters(const SourceText& source, Diagnostics& diagnostics) {
  const std::string_view text = source.text();
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character_length(text.substr(i));
    if (length == 0) {
      diagnostics.add(source.place(source.position(i)),
                      "the byte " + hexadecimal(text[i]) + " is not valid UTF-8; is this a YAML file?");
      return false;
    }
    if (is_forbidden_control(text[i])) {
      diagnostics.add(source.place(source.position(i)), "the control character " + hexadecimal(text[i]) +
                                                            " is not allowed in text; is this a YAML file?");
      return false;
    }
    i += length;
  }
  return true;
}

bool check_indentation(const SourceText& source, Diagnostics& diagnostics) {
  const std::string& text = source.text();
  bool good = true;
  for (std::size_t begin = 0; begin < text.size() && !diagnostics.full();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::size_t first = begin;
    while (first < end && (text[first] == ' ' || text[first] == '\t' || text[first] == '\r'))
      ++first;
    const std::size_t tab = std::string_view(text).substr(begin, first - begin).find('\t');
    if (tab != std::string_view::npos && first < end && text[first] != '#') {
      diagnostics.add(source.place(source.position(begin + tab)),
                      "a tab in the indentation; indent with spaces");
      good = false;
    }
    begin = end + 1;
  }
  return good;
}

std::string too_large(std::uintmax_t bytes) {
  return "is too large: " + std::to_string(bytes) + " bytes, and at most " +
         std::to_string(max_file_bytes / (1024 * 1024)) + " MiB (" + std::to_string(max_file_bytes) +
         " bytes) are read";
}

std::optional<std::string> read_bytes(const std::string& path, Diagnostics& diagnostics) {
  const auto refuse = [&](const std::string& why) {
    diagnostics.add({path.empty() ? "''" : path, 0, 0}, why);
    return std::nullopt;
  };
  if (path.empty()) return refuse("the name of a file is needed, not an empty text");
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return refuse("there is no such file");
  if (error) return refuse("can not be read: " + error.message());
  if (status.type() == fs::file_type::directory) return refuse("is a directory, not a file");
  if (status.type() != fs::file_type::regular) return refuse("is not a regular file");
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return refuse("can not be read: " + error.message());
  if (size > max_file_bytes) return refuse(too_large(size));
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return refuse(std::string("can not be opened: ") + std::strerror(errno));
  // One byte more than allowed, in case the file grows while it is read.
  std::string text(max_file_bytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) return refuse("reading failed");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  text.shrink_to_fit();
  if (text.size() > max_file_bytes) return refuse(too_large(text.size()));
  return text;
}

}  // namespace

SourceText::SourceText(std::string name, std::string directory, std::string text)
    : name_(std::move(name)), directory_(std::move(directory)), text_(std::move(text)), line_starts_{0} {
  std::uint32_t characters = 0;
  for (std::size_t i = 0; i < text_.size(); ++i) {
    if (i % block_bytes == 0) characters_before_block_.push_back(characters);
    if (!is_continuation(text_[i])) ++characters;
    if (text_[i] == '\n') line_starts_.push_back(i + 1);
  }
  if (text_.size() % block_bytes == 0) characters_before_block_.push_back(characters);
}

std::size_t SourceText::offset(TextPosition position) const {
  if (position.line >= line_starts_.size()) return text_.size();
  return std::min(line_starts_[position.line] + position.byte, text_.size());
}

TextPosition SourceText::position(std::size_t offset) const {
  const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const auto line = static_cast<std::size_t>(next - line_starts_.begin()) - 1;
  return {static_cast<std::uint32_t>(line), static_cast<std::uint32_t>(offset - line_starts_[line])};
}

Place SourceText::place(TextPosition position) const {
  const std::size_t end = offset(position);
  const TextPosition within = this->position(end);
  const std::uint32_t column = characters_before(end) - characters_before(line_starts_[within.line]) + 1;
  return {name_, within.line + 1, column};
}

std::uint32_t SourceText::characters_before(std::size_t offset) const {
  std::uint32_t characters = characters_before_block_[offset / block_bytes];
  for (std::size_t i = offset / block_bytes * block_bytes; i < offset; ++i) {
    if (!is_continuation(text_[i])) ++characters;
  }
  return characters;
}

TextPosition SourceText::behind_anchor(TextPosition begin) const {
  std::size_t at = offset(begin);
  if (at >= text_.size() || text_[at] != '&') return begin;
  while (at < text_.size() && !is_blank(text_[at]))
    ++at;
  while (at < text_.size() && is_blank(text_[at]))
    ++at;
  return position(at);
}

bool SourceText::is_closed(TextPosition begin) const {
  const std::size_t at = offset(begin);
  const char quote = at < text_.size() ? text_[at] : ' ';
  if (quote != '\'' && quote != '"') return true;
  for (std::size_t i = at + 1; i < text_.size(); ++i) {
    if (quote == '"' && text_[i] == '\\') {
      ++i;
    } else if (text_[i] == quote) {
      if (quote == '"' || i + 1 >= text_.size() || text_[i + 1] != quote) return true;
      ++i;  // two single quotes stand for one
    }
  }
  return false;
}

Place SourceText::place_in_scalar(TextPosition begin, std::string_view scalar, std::size_t index) const {
  std::size_t at = offset(begin);
  const char opening = at < text_.size() ? text_[at] : ' ';
  if (opening == '|' || opening == '>') {
    at = std::min(text_.find('\n', at), text_.size());
  } else if (opening == '"' || opening == '\'') {
    ++at;
  }
  // Folding changes blanks only, so the other characters of the scalar stand in the text in the same order.
  for (std::size_t i = 0; i < std::min(index + 1, scalar.size()); ++i) {
    if (is_blank(scalar[i])) continue;
    const std::size_t found = text_.find(scalar[i], at);
    if (found == std::string::npos) return place(begin);
    if (i == index) return place(position(found));
    at = found + 1;
  }
  return place(position(at));
}

std::shared_ptr<const SourceText> read_source(const std::string& path, Diagnostics& diagnostics) {
  std::optional<std::string> text = read_bytes(path, diagnostics);
  if (!text) return nullptr;
  if (text->starts_with(byte_order_mark)) text->erase(0, byte_order_mark.size());
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  return std::make_shared<const SourceText>(path, absolute.parent_path().string(), std::move(*text));
}

std::shared_ptr<const SourceText> source_of_text(const std::string& name, std::string_view text,
                                                 Diagnostics& diagnostics) {
  if (text.size() > max_file_bytes) {
    diagnostics.add({name, 0, 0}, too_large(text.size()));
    return nullptr;
  }
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  std::error_code error;
  return std::make_shared<const SourceText>(name, fs::current_path(error).string(), std::string(text));
}

bool check_source(const SourceText& source, Diagnostics& diagnostics) {
  return check_characters(source, diagnostics) && check_indentation(source, diagnostics);
}

}  // namespace hil::config
