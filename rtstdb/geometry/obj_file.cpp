#include "rtstdb/geometry/obj_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <rtstdb/limits.hpp>
#include <rtstdb/srgb.hpp>

#include "rtstdb/geometry/corner_attributes.hpp"
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

/// Removes all words and returns their numbers. None: one is not a finite number, or there are more than fit.
template <std::size_t max_count>
std::optional<std::size_t> take_numbers(std::string_view text, std::array<double, max_count>& values) {
  std::size_t count = 0;
  for (std::string_view word = take_word(text); !word.empty(); word = take_word(text), ++count) {
    const auto value = number_of<double>(word);
    if (!value || !std::isfinite(*value) || count == max_count) return std::nullopt;
    values[count] = *value;
  }
  return count;
}

/// Reads the statements of a file twice: first what faces refer to, since a face may precede it.
class ObjReader {
 public:
  ObjReader(std::string_view text, double scale) : text_(text), scale_(scale) {}

  TriangleMesh read() {
    for (Statements all(text_); all.next();) {
      std::string_view rest = all.text();
      const std::string_view keyword = take_word(rest);
      if (keyword == "v") read_vertex(all, rest);
      if (keyword == "vn") read_normal(all, rest);
      report.materials_ignored |= keyword == "mtllib" || keyword == "usemtl";
      report.textures_ignored |= keyword == "vt";
    }
    std::size_t vertices_before = 0, normals_before = 0;
    for (Statements all(text_); all.next();) {
      std::string_view rest = all.text();
      const std::string_view keyword = take_word(rest);
      vertices_before += keyword == "v" ? 1 : 0;
      normals_before += keyword == "vn" ? 1 : 0;
      if (keyword == "f" || keyword == "fo") read_face(all, rest, vertices_before, normals_before);
    }
    complete_corner_attributes(mesh_);
    return std::move(mesh_);
  }

  MeshFileReport report;

 private:
  /// A weight other than 1 is refused: it is for curves, and readers disagree on its effect on polygons.
  void read_vertex(const Statements& statement, std::string_view rest) {
    std::array<double, 7> values{};
    const auto count = take_numbers(rest, values);
    if (!count || *count < 3) statement.refuse("is not a vertex of three to seven finite numbers");
    if (*count == 4 && values[3] != 1.0)
      statement.refuse("has a weight other than 1, which is not supported");
    if (*count == 5)
      statement.refuse("has 5 numbers; a vertex has 3, 4 with a weight, or 6 or 7 with a colour");
    mesh_.positions_m.emplace_back(scale_ * glm::dvec3(values[0], values[1], values[2]));
    if (*count < 6) return;
    glm::vec3 color(0.0f);
    for (int i = 0; i < 3; ++i) {
      const double encoded = values[3 + static_cast<std::size_t>(i)];
      if (encoded < 0.0 || encoded > 1.0)
        statement.refuse("has a colour beyond the range of 0 to 1 of red, green and blue");
      color[i] = static_cast<float>(linear_from_srgb(encoded));
    }
    colors_.resize(mesh_.positions_m.size() - 1, glm::vec3(1.0f));
    colors_.push_back(color);
  }

  void read_normal(const Statements& statement, std::string_view rest) {
    std::array<double, 3> values{};
    if (take_numbers(rest, values) != values.size())
      statement.refuse("is not a normal of three finite numbers");
    normals_.emplace_back(unit_or_zero({values[0], values[1], values[2]}));
  }

  /// The index in a corner of a face, from 0; `count`: number of such elements in the file; `before`: number
  /// of those before the face, for relative indices.
  static std::uint32_t index_of(const Statements& statement, std::string_view corner, std::string_view word,
                                std::size_t count, std::size_t before, const char* elements) {
    const auto most = static_cast<std::int64_t>(count);
    const auto last = static_cast<std::int64_t>(before);
    const auto index = number_of<std::int64_t>(word);
    if (!index || *index == 0 || *index > most || *index < -last)
      statement.refuse("has a corner '" + std::string(corner) + "'; the count of " + elements + " is " +
                       std::to_string(count) + ", and " + std::to_string(before) + " come before it");
    return static_cast<std::uint32_t>(*index > 0 ? *index - 1 : last + *index);
  }

  void read_face(const Statements& statement, std::string_view rest, std::size_t vertices_before,
                 std::size_t normals_before) {
    corners_.clear();
    corner_normals_.clear();
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      const std::size_t slash = word.find('/');
      corners_.push_back(index_of(statement, word, word.substr(0, slash), mesh_.positions_m.size(),
                                  vertices_before, "vertices"));
      const std::size_t second = slash == word.npos ? slash : word.find('/', slash + 1);
      const std::string_view normal = second == word.npos ? std::string_view() : word.substr(second + 1);
      corner_normals_.push_back(
          normal.empty()
              ? glm::vec3(0.0f)
              : normals_[index_of(statement, word, normal, normals_.size(), normals_before, "normals")]);
    }
    if (corners_.size() < 3)
      statement.refuse("has " + counted(corners_.size(), "corner") + "; a face has three or more");
    if (corners_.size() > max_polygon_corners)
      statement.refuse("has " + std::to_string(corners_.size()) + " corners; up to " +
                       std::to_string(max_polygon_corners) + " are triangulated");
    append_face();
  }

  void append_face() {
    places_.clear();
    triangulate_polygon(mesh_.positions_m, corners_, places_);
    for (const glm::uvec3& at : places_) {
      const glm::uvec3& triangle =
          mesh_.triangles.emplace_back(corners_[at.x], corners_[at.y], corners_[at.z]);
      set_last_normals(mesh_, {corner_normals_[at.x], corner_normals_[at.y], corner_normals_[at.z]});
      if (!colors_.empty())
        set_last_colors(mesh_, {color_of(triangle.x), color_of(triangle.y), color_of(triangle.z)});
    }
  }
  glm::vec3 color_of(std::uint32_t vertex) const {
    return vertex < colors_.size() ? colors_[vertex] : glm::vec3(1.0f);
  }

  std::string_view text_;
  double scale_;
  TriangleMesh mesh_;
  std::vector<glm::vec3> normals_;
  std::vector<glm::vec3> colors_;  ///< of the vertices up to the last one with a colour
  // Of the current face.
  std::vector<std::uint32_t> corners_;
  std::vector<glm::vec3> corner_normals_;
  std::vector<glm::uvec3> places_;
};

}  // namespace

TriangleMesh read_obj(std::string_view text, double scale, MeshFileReport* report) {
  ObjReader reader(text, scale);
  TriangleMesh mesh = reader.read();
  if (report != nullptr) *report = reader.report;
  return mesh;
}

}  // namespace rtstdb
