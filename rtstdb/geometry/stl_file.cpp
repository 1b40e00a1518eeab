#include "rtstdb/geometry/stl_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include "rtstdb/geometry/counted.hpp"

namespace rtstdb {
namespace stl {
namespace {

constexpr std::string_view blanks = " \t\r\f\v";
constexpr std::size_t header_bytes = 80;
constexpr std::size_t count_bytes = 4;
constexpr std::size_t facet_bytes = 50;
constexpr std::size_t normal_bytes = 12;

bool equal_words(std::string_view word, std::string_view lower_case) {
  return std::ranges::equal(word, lower_case,
                            [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; });
}

bool is_text(std::string_view file) {
  const std::size_t first = file.find_first_not_of(" \t\r\n\f\v");
  constexpr std::string_view begin = "solid";
  return first != std::string_view::npos && equal_words(file.substr(first, begin.size()), begin) &&
         file.substr(0, header_bytes + count_bytes).find('\0') == std::string_view::npos;
}

void append_facet(TriangleMesh& mesh, const std::array<glm::dvec3, 3>& corners, double scale) {
  const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
  for (const glm::dvec3& corner : corners)
    mesh.positions_m.emplace_back(corner * scale);
  mesh.triangles.emplace_back(first, first + 1, first + 2);
}

TriangleMesh read_binary(std::string_view file, double scale) {
  if (file.size() < header_bytes + count_bytes)
    throw std::runtime_error("it has " + std::to_string(file.size()) +
                             " bytes, and a binary STL file has at least 84");
  std::uint32_t count = 0;
  std::memcpy(&count, file.data() + header_bytes, sizeof count);
  const std::uint64_t needed = header_bytes + count_bytes + std::uint64_t{count} * facet_bytes;
  if (needed != file.size())
    throw std::runtime_error("its header gives " + counted(count, "triangle") +
                             ", for which the file needs " + std::to_string(needed) + " bytes, and it has " +
                             std::to_string(file.size()));
  TriangleMesh mesh;
  mesh.positions_m.reserve(std::size_t{3} * count);
  mesh.triangles.reserve(count);
  for (std::size_t facet = 0; facet < count; ++facet) {
    std::array<float, 9> values{};
    std::memcpy(values.data(), file.data() + header_bytes + count_bytes + facet * facet_bytes + normal_bytes,
                sizeof values);
    std::array<glm::dvec3, 3> corners{};
    for (std::size_t k = 0; k < corners.size(); ++k)
      corners[k] = glm::dvec3(values[3 * k], values[3 * k + 1], values[3 * k + 2]);
    append_facet(mesh, corners, scale);
  }
  return mesh;
}

class TextReader {
 public:
  TextReader(std::string_view text, double scale) : rest_(text), scale_(scale) {}

  TriangleMesh read() {
    for (std::string_view word = take_word(); !word.empty(); word = take_word()) {
      if (!equal_words(word, "solid")) refuse(word, "'solid'");
      skip_line();  // the name
      read_solid();
    }
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(std::string_view found, const std::string& expected) const {
    constexpr std::size_t max_quoted = 40;
    throw std::runtime_error(
        "line " + std::to_string(line_) + ": " +
        (found.empty() ? "the file ends" : "'" + std::string(found.substr(0, max_quoted)) + "' is found") +
        " where " + expected + " is expected");
  }

  /// The next word; empty at the end of the file.
  std::string_view take_word() {
    std::size_t begin = 0;
    for (; begin < rest_.size() && (rest_[begin] == '\n' || blanks.find(rest_[begin]) != blanks.npos);
         ++begin)
      line_ +=
          rest_[begin] == '\n' || (rest_[begin] == '\r' && !rest_.substr(begin).starts_with("\r\n")) ? 1 : 0;
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n\f\v"));
    rest_.remove_prefix(word.size());
    return word;
  }
  void skip_line() { rest_.remove_prefix(std::min(rest_.find_first_of("\r\n"), rest_.size())); }
  void expect(std::string_view expected) {
    const std::string_view word = take_word();
    if (!equal_words(word, expected)) refuse(word, "'" + std::string(expected) + "'");
  }
  double number() {
    const std::string_view word = take_word();
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    double value = 0.0;
    const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (fault != std::errc{} || end != digits.data() + digits.size() || digits.empty())
      refuse(word, "a number");
    return value;
  }

  void read_solid() {
    for (std::string_view word = take_word(); !equal_words(word, "endsolid"); word = take_word()) {
      if (!equal_words(word, "facet")) refuse(word, "'facet' or 'endsolid'");
      read_facet();
    }
    skip_line();
  }
  void read_facet() {
    expect("normal");
    for (int k = 0; k < 3; ++k)
      if (take_word().empty()) refuse("", "a number");  // not used, and often not a number
    expect("outer");
    expect("loop");
    std::array<glm::dvec3, 3> corners{};
    for (glm::dvec3& corner : corners) {
      expect("vertex");
      corner.x = number();
      corner.y = number();
      corner.z = number();
    }
    expect("endloop");
    expect("endfacet");
    append_facet(mesh_, corners, scale_);
  }

  std::string_view rest_;
  double scale_;
  std::size_t line_ = 1;
  TriangleMesh mesh_;
};

}  // namespace
}  // namespace stl

TriangleMesh read_stl(std::string_view file, double scale) {
  return stl::is_text(file) ? stl::TextReader(file, scale).read() : stl::read_binary(file, scale);
}

}  // namespace rtstdb
