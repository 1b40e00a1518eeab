#include "rtstdb/geometry/ply_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/corner_attributes.hpp"
#include "rtstdb/geometry/counted.hpp"
#include "rtstdb/geometry/ply_header.hpp"
#include "rtstdb/geometry/ply_vertex.hpp"
#include "rtstdb/geometry/polygon.hpp"

namespace rtstdb {
namespace {

using ply::Element;
using ply::Format;
using ply::Property;
using ply::Type;

/// Reads numbers one by one from the data of the file; each number has at least one byte.
class Numbers {
 public:
  Numbers(std::string_view bytes, const ply::Header& header)
      : bytes_(bytes), at_(header.size_bytes), format_(header.format) {}

  double next(Type type) { return format_ == Format::text ? next_in_text() : next_in_binary(type); }

  /// Number of bytes after the last number read, without blanks at the end of the file.
  std::size_t bytes_left() const {
    const std::size_t end = bytes_.find_last_not_of(" \t\r\n") + 1;
    return end > at_ ? end - at_ : 0;
  }

  [[noreturn]] void fail(const std::string& fault) const {
    throw std::runtime_error("PLY data, byte " + std::to_string(at_) + ": " + fault);
  }

 private:
  double next_in_text() {
    at_ = std::min(bytes_.find_first_not_of(" \t\r\n", at_), bytes_.size());
    if (at_ == bytes_.size()) fail("the file ends before its data do");
    const char* begin = bytes_.data() + at_;
    const char* end = bytes_.data() + bytes_.size();
    if (*begin == '+') ++begin;
    double value = 0.0;
    const auto [read_to, error] = std::from_chars(begin, end, value);
    const bool ends_well =
        read_to == end || *read_to == ' ' || *read_to == '\t' || *read_to == '\r' || *read_to == '\n';
    if (error != std::errc() || !ends_well) fail("no number");
    at_ = static_cast<std::size_t>(read_to - bytes_.data());
    return value;
  }

  template <class T>
  double take() {
    if (bytes_.size() - at_ < sizeof(T)) fail("the file ends before its data do");
    char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    const bool file_is_little = format_ == Format::little_endian;
    if (file_is_little != (std::endian::native == std::endian::little)) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return static_cast<double>(value);
  }

  double next_in_binary(Type type) {
    switch (type) {
      case Type::int8:
        return take<std::int8_t>();
      case Type::uint8:
        return take<std::uint8_t>();
      case Type::int16:
        return take<std::int16_t>();
      case Type::uint16:
        return take<std::uint16_t>();
      case Type::int32:
        return take<std::int32_t>();
      case Type::uint32:
        return take<std::uint32_t>();
      case Type::float32:
        return take<float>();
      case Type::float64:
        return take<double>();
    }
    fail("unknown type");
  }

  std::string_view bytes_;
  std::size_t at_;
  Format format_;
};

/// A number that must be a count or an index below `limit`.
std::uint32_t whole(const Numbers& numbers, double value, double limit, const char* what) {
  if (!(value >= 0.0 && value < limit) || value != static_cast<double>(static_cast<std::uint32_t>(value)))
    numbers.fail(std::to_string(value) + " is no " + what);
  return static_cast<std::uint32_t>(value);
}

class PlyReader {
 public:
  PlyReader(std::string_view bytes, double scale)
      : header_(ply::read_header(bytes)), numbers_(bytes, header_), scale_(scale) {}

  TriangleMesh read() {
    for (const Element& element : header_.elements) {
      if (element.properties.empty()) continue;
      if (element.name == "vertex") {
        read_vertices(element);
        continue;
      }
      const bool is_face = element.name == "face";
      for (std::uint64_t i = 0; i < element.count; ++i)
        read_other(element, is_face);
    }
    check_end();
    cut_polygons();
    complete_corner_attributes(mesh_);
    return std::move(mesh_);
  }

  MeshFileReport report() const {
    const auto is_material = [](const Element& element) { return element.name == "material"; };
    return {.materials_ignored = std::ranges::any_of(header_.elements, is_material),
            .textures_ignored = header_.names_texture};
  }

 private:
  void check_end() const {
    const std::size_t left = numbers_.bytes_left();
    if (left == 0) return;
    std::string counts;
    for (const Element& element : header_.elements)
      counts += (counts.empty() ? "" : ", ") + element.name + " " + std::to_string(element.count);
    numbers_.fail("the elements that the header counts (" + counts + ") end here, and the file has " +
                  counted(left, "more byte"));
  }

  void read_vertices(const Element& element) {
    const ply::VertexLayout layout(element);
    for (std::uint64_t vertex = 0; vertex < element.count; ++vertex) {
      ply::VertexValues values{};
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const Property& property = element.properties[i];
        if (property.is_list) {
          read_list(property, false);
          continue;
        }
        const double value = numbers_.next(property.type);
        if (layout.place_of(i) != layout.none) values[layout.place_of(i)] = value;
      }
      mesh_.positions_m.emplace_back(layout.position(values) * scale_);
      // A file may have further elements of this name with other properties.
      if (layout.has_normals()) {
        normals_.resize(mesh_.positions_m.size() - 1, glm::vec3(0.0f));
        normals_.push_back(layout.normal(values, vertex));
      }
      if (layout.has_colors()) {
        colors_.resize(mesh_.positions_m.size() - 1, glm::vec3(1.0f));
        colors_.push_back(layout.color(values, vertex));
      }
    }
  }

  void read_other(const Element& element, bool is_face) {
    for (const Property& property : element.properties) {
      if (property.is_list) {
        const bool names_corners = property.name == "vertex_indices" || property.name == "vertex_index";
        read_list(property, is_face && names_corners);
      } else {
        numbers_.next(property.type);
      }
    }
  }

  void read_list(const Property& property, bool is_polygon) {
    constexpr double any = 4294967296.0;
    const std::uint32_t count = whole(numbers_, numbers_.next(property.count_type), any, "count of a list");
    for (std::uint32_t i = 0; i < count; ++i) {
      const double value = numbers_.next(property.type);
      if (is_polygon) corners_.push_back(whole(numbers_, value, any, "corner index"));
    }
    if (is_polygon && count < 3)
      throw std::runtime_error("PLY data: face " + std::to_string(polygon_ends_.size()) + " has " +
                               counted(count, "corner") + "; a face has three or more");
    if (is_polygon && count > max_polygon_corners)
      throw std::runtime_error("PLY data: face " + std::to_string(polygon_ends_.size()) + " has " +
                               std::to_string(count) + " corners; up to " +
                               std::to_string(max_polygon_corners) + " are triangulated");
    if (is_polygon) polygon_ends_.push_back(corners_.size());
  }

  /// Called at the end, since a face may precede its positions.
  void cut_polygons() {
    if (!normals_.empty()) normals_.resize(mesh_.positions_m.size(), glm::vec3(0.0f));
    if (!colors_.empty()) colors_.resize(mesh_.positions_m.size(), glm::vec3(1.0f));
    std::size_t begin = 0;
    for (std::size_t face = 0; face < polygon_ends_.size(); ++face) {
      const std::size_t end = polygon_ends_[face];
      for (std::size_t i = begin; i < end; ++i) {
        if (corners_[i] >= mesh_.positions_m.size())
          throw std::runtime_error("PLY data: face " + std::to_string(face) + " has corner index " +
                                   std::to_string(corners_[i]) + ", and the count of positions is " +
                                   std::to_string(mesh_.positions_m.size()));
      }
      places_.clear();
      const std::span corners = std::span(corners_).subspan(begin, end - begin);
      triangulate_polygon(mesh_.positions_m, corners, places_);
      for (const glm::uvec3& at : places_)
        append_triangle({corners[at.x], corners[at.y], corners[at.z]});
      begin = end;
    }
  }

  void append_triangle(const glm::uvec3& triangle) {
    mesh_.triangles.push_back(triangle);
    const auto [a, b, c] = std::array{triangle.x, triangle.y, triangle.z};
    if (!normals_.empty()) set_last_normals(mesh_, {normals_[a], normals_[b], normals_[c]});
    if (!colors_.empty()) set_last_colors(mesh_, {colors_[a], colors_[b], colors_[c]});
  }

  ply::Header header_;
  Numbers numbers_;
  double scale_;
  TriangleMesh mesh_;
  std::vector<std::uint32_t> corners_;
  std::vector<std::size_t> polygon_ends_;
  std::vector<glm::vec3> normals_, colors_;  ///< of the positions; empty: the file has none
  std::vector<glm::uvec3> places_;           ///< of the current polygon's triangles
};

}  // namespace

TriangleMesh read_ply(std::string_view bytes, double scale, MeshFileReport* report) {
  PlyReader reader(bytes, scale);
  TriangleMesh mesh = reader.read();
  if (report != nullptr) *report = reader.report();
  return mesh;
}

}  // namespace rtstdb
