#include "rtstdb/geometry/ply_vertex.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

#include <rtstdb/srgb.hpp>

#include "rtstdb/geometry/corner_attributes.hpp"
#include "rtstdb/geometry/value_text.hpp"

namespace rtstdb::ply {
namespace {

constexpr std::array<std::string_view, VertexLayout::none> value_names{"x",  "y",   "z",     "nx",  "ny",
                                                                       "nz", "red", "green", "blue"};
constexpr std::size_t first_normal = 3, first_color = 6;

/// The number of white in a colour of this type; 0: colours do not have this type.
double brightest_of(Type type) {
  switch (type) {
    case Type::uint8:
      return 255.0;
    case Type::uint16:
      return 65535.0;
    case Type::float32:
    case Type::float64:
      return 1.0;
    case Type::int8:
    case Type::int16:
    case Type::int32:
    case Type::uint32:
      return 0.0;
  }
  return 0.0;
}

[[noreturn]] void refuse_vertex(std::uint64_t vertex, const std::string& fault) {
  throw std::runtime_error("PLY data: vertex " + std::to_string(vertex) + " has the " + fault);
}

}  // namespace

VertexLayout::VertexLayout(const Element& element) : places_(element.properties.size(), none) {
  std::array<bool, none> is_there{};
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const Property& property = element.properties[i];
    const auto place =
        static_cast<std::size_t>(std::ranges::find(value_names, property.name) - value_names.begin());
    if (property.is_list || place == none) continue;
    places_[i] = place;
    is_there[place] = true;
    if (place < first_color) continue;
    brightest_[place - first_color] = brightest_of(property.type);
    if (brightest_[place - first_color] == 0.0)
      throw std::runtime_error("PLY header: the vertex property " + property.name +
                               " is of a type that colours do not have; uchar, ushort, float and double are "
                               "read");
  }
  const auto has_group = [&](std::size_t first) {
    const auto count = std::count(is_there.begin() + static_cast<std::ptrdiff_t>(first),
                                  is_there.begin() + static_cast<std::ptrdiff_t>(first) + 3, true);
    if (count == 0 || count == 3) return count == 3;
    std::string lacking;
    for (std::size_t i = first; i < first + 3; ++i)
      if (!is_there[i]) lacking += (lacking.empty() ? "" : ", ") + std::string(value_names[i]);
    throw std::runtime_error("PLY header: the element vertex lacks " + lacking +
                             (first == first_normal ? " of its normals" : " of its colours"));
  };
  has_normals_ = has_group(first_normal);
  has_colors_ = has_group(first_color);
}

glm::vec3 VertexLayout::normal(const VertexValues& values, std::uint64_t vertex) const {
  const glm::dvec3 normal(values[first_normal], values[first_normal + 1], values[first_normal + 2]);
  if (!std::isfinite(normal.x) || !std::isfinite(normal.y) || !std::isfinite(normal.z))
    refuse_vertex(vertex, "normal " + text_of(normal) + ", which is not finite");
  return glm::vec3(unit_or_zero(normal));
}

glm::vec3 VertexLayout::color(const VertexValues& values, std::uint64_t vertex) const {
  glm::vec3 color(0.0f);
  for (std::size_t i = 0; i < 3; ++i) {
    const double value = values[first_color + i];
    if (!(value >= 0.0 && value <= brightest_[i]))
      refuse_vertex(vertex,
                    "colour " +
                        text_of({values[first_color], values[first_color + 1], values[first_color + 2]}) +
                        ", and its " + std::string(value_names[first_color + i]) + " is 0 to " +
                        std::to_string(static_cast<int>(brightest_[i])));
    color[static_cast<int>(i)] = static_cast<float>(linear_from_srgb(value / brightest_[i]));
  }
  return color;
}

}  // namespace rtstdb::ply
