#include "rtstdb/geometry/ply_header.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <stdexcept>
#include <utility>

namespace rtstdb::ply {
namespace {

[[noreturn]] void fail(std::size_t line, const std::string& fault) {
  throw std::runtime_error("PLY header, line " + std::to_string(line) + ": " + fault);
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(" \t\r"), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

Type type_of(std::string_view word, std::size_t line) {
  constexpr std::array<std::pair<std::string_view, Type>, 16> names{{{"char", Type::int8},
                                                                     {"int8", Type::int8},
                                                                     {"uchar", Type::uint8},
                                                                     {"uint8", Type::uint8},
                                                                     {"short", Type::int16},
                                                                     {"int16", Type::int16},
                                                                     {"ushort", Type::uint16},
                                                                     {"uint16", Type::uint16},
                                                                     {"int", Type::int32},
                                                                     {"int32", Type::int32},
                                                                     {"uint", Type::uint32},
                                                                     {"uint32", Type::uint32},
                                                                     {"float", Type::float32},
                                                                     {"float32", Type::float32},
                                                                     {"double", Type::float64},
                                                                     {"float64", Type::float64}}};
  for (const auto& [name, type] : names) {
    if (word == name) return type;
  }
  fail(line, "unknown type '" + std::string(word) + "'");
}

Format format_of(const std::vector<std::string_view>& words, std::size_t line) {
  if (words.size() == 3 && words[2] == "1.0") {
    if (words[1] == "ascii") return Format::text;
    if (words[1] == "binary_little_endian") return Format::little_endian;
    if (words[1] == "binary_big_endian") return Format::big_endian;
  }
  fail(line, "a format that is neither ascii, binary_little_endian nor binary_big_endian 1.0");
}

Element element_of(const std::vector<std::string_view>& words, std::size_t line) {
  if (words.size() != 3) fail(line, "an element needs a name and a count");
  Element element{std::string(words[1]), 0, {}};
  const char* end = words[2].data() + words[2].size();
  const auto [read_to, error] = std::from_chars(words[2].data(), end, element.count);
  if (error != std::errc() || read_to != end) fail(line, "'" + std::string(words[2]) + "' is not a count");
  return element;
}

Property property_of(const std::vector<std::string_view>& words, std::size_t line) {
  if (words.size() == 3) return {std::string(words[2]), type_of(words[1], line), false, Type::uint8};
  if (words.size() != 5 || words[1] != "list") fail(line, "a property needs a type and a name");
  const Type count_type = type_of(words[2], line);
  if (count_type == Type::float32 || count_type == Type::float64)
    fail(line, "the count of a list is not an integer type");
  return {std::string(words[4]), type_of(words[3], line), true, count_type};
}

}  // namespace

Header read_header(std::string_view bytes) {
  // Lines end with "\r" alone only if the first one does.
  const char line_end = bytes.starts_with("ply\r") && !bytes.starts_with("ply\r\n") ? '\r' : '\n';
  Header header;
  bool has_format = false;
  for (std::size_t line = 1;; ++line) {
    const std::size_t end = bytes.find(line_end, header.size_bytes);
    if (end == std::string_view::npos) fail(line, "the file ends within the header");
    const auto words = words_of(bytes.substr(header.size_bytes, end - header.size_bytes));
    header.size_bytes = end + 1;
    if (line == 1) {
      if (words.size() != 1 || words[0] != "ply") fail(line, "the first line is not 'ply'");
    } else if (words.empty() || words[0] == "comment" || words[0] == "obj_info") {
      header.names_texture |= words.size() > 1 && words[1] == "TextureFile";
    } else if (words[0] == "format") {
      header.format = format_of(words, line);
      has_format = true;
    } else if (words[0] == "element") {
      header.elements.push_back(element_of(words, line));
    } else if (words[0] == "property") {
      if (header.elements.empty()) fail(line, "a property before the first element");
      header.elements.back().properties.push_back(property_of(words, line));
    } else if (words[0] == "end_header") {
      if (!has_format) fail(line, "the header ends without a format");
      return header;
    } else {
      fail(line, "unknown word '" + std::string(words[0]) + "'");
    }
  }
}

}  // namespace rtstdb::ply
