#include "rtstdb/geometry/obj_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/counted.hpp"
#include "rtstdb/geometry/polygon.hpp"

namespace rtstdb {
namespace {

constexpr std::string_view blanks = " \t\r\f\v";
constexpr std::size_t max_quoted = 60;

/// Statements one by one, continued lines joined.
class Statements {
 public:
  explicit Statements(std::string_view text) : rest_(text) {}
  bool next() {
    if (rest_.empty()) return false;
    line_ = next_line_;
    text_.clear();
    for (bool goes_on = true; goes_on && !rest_.empty();) {
      std::string_view line = rest_.substr(0, rest_.find_first_of("\r\n"));
      rest_.remove_prefix(line.size());
      rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, rest_.size()));
      ++next_line_;
      goes_on = line.ends_with('\\');
      if (goes_on) line.remove_suffix(1);
      text_.append(line).append(goes_on ? " " : "");
    }
    if (const std::size_t comment = text_.find('#'); comment != std::string::npos) text_.resize(comment);
    return true;
  }
  std::string_view text() const { return text_; }
  [[noreturn]] void refuse(const std::string& fault) const {
    std::string_view quoted = text_;
    quoted.remove_prefix(std::min(quoted.find_first_not_of(blanks), quoted.size()));
    quoted = quoted.substr(0, quoted.find_last_not_of(blanks) + 1);
    throw std::runtime_error("line " + std::to_string(line_) + ": '" +
                             std::string(quoted.substr(0, max_quoted)) +
                             (quoted.size() > max_quoted ? "..." : "") + "' " + fault);
  }

 private:
  std::string_view rest_;
  std::string text_;
  std::size_t line_ = 1, next_line_ = 1;
};

/// Removes the first word and returns it; empty: there is none.
std::string_view take_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(blanks));
  text.remove_prefix(word.size());
  return word;
}

template <class Number>
std::optional<Number> number_of(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// The coordinates of a vertex. A weight other than 1 is refused: it is for curves, and readers disagree on
/// its effect on polygons.
glm::vec3 vertex_of(const Statements& statement, std::string_view rest, double scale) {
  std::array<double, 7> values{};
  std::size_t count = 0;
  for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest), ++count) {
    const auto value = number_of<double>(word);
    if (!value || !std::isfinite(*value) || count == values.size())
      statement.refuse("is not a vertex of three to seven finite numbers");
    values[count] = *value;
  }
  if (count < 3) statement.refuse("is not a vertex of three to seven finite numbers");
  if (count == 4 && values[3] != 1.0) statement.refuse("has a weight other than 1, which is not supported");
  return glm::vec3(scale * glm::dvec3(values[0], values[1], values[2]));
}

/// The corners of a face. `vertices`: number of vertices in the file; `before`: number of those before the
/// face, for relative indices.
void append_corners(const Statements& statement, std::string_view rest, std::size_t before,
                    std::size_t vertices, std::vector<std::uint32_t>& corners) {
  const auto most = static_cast<std::int64_t>(vertices);
  const auto last = static_cast<std::int64_t>(before);
  corners.clear();
  for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
    const auto index = number_of<std::int64_t>(word.substr(0, word.find('/')));
    if (!index || *index == 0 || *index > most || *index < -last)
      statement.refuse("has a corner '" + std::string(word) + "'; the count of vertices is " +
                       std::to_string(vertices) + ", and " + std::to_string(before) + " come before it");
    corners.push_back(static_cast<std::uint32_t>(*index > 0 ? *index - 1 : last + *index));
  }
  if (corners.size() < 3)
    statement.refuse("has " + counted(corners.size(), "corner") + "; a face has three or more");
  if (corners.size() > max_polygon_corners)
    statement.refuse("has " + std::to_string(corners.size()) + " corners; up to " +
                     std::to_string(max_polygon_corners) + " are triangulated");
}

}  // namespace

TriangleMesh read_obj(std::string_view text, double scale) {
  TriangleMesh mesh;
  for (Statements all(text); all.next();) {
    std::string_view rest = all.text();
    if (take_word(rest) == "v") mesh.positions_m.push_back(vertex_of(all, rest, scale));
  }
  std::size_t before = 0;
  std::vector<std::uint32_t> corners;
  // A face may precede its vertices.
  for (Statements all(text); all.next();) {
    std::string_view rest = all.text();
    const std::string_view keyword = take_word(rest);
    before += keyword == "v" ? 1 : 0;
    if (keyword != "f" && keyword != "fo") continue;
    append_corners(all, rest, before, mesh.positions_m.size(), corners);
    triangulate_polygon(mesh.positions_m, corners, mesh.triangles);
  }
  return mesh;
}

}  // namespace rtstdb
