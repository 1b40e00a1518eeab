#include "rtstdb/geometry/gltf_corners.hpp"

#include <glm/common.hpp>

#include <array>
#include <cmath>
#include <cstring>

#include "rtstdb/geometry/value_text.hpp"

namespace rtstdb::gltf {
namespace {

template <class Component>
std::array<Component, 3> components_at(const Accessor& accessor, std::uint64_t element) {
  std::array<Component, 3> values{};  // little-endian, as this machine is
  std::memcpy(values.data(), accessor.bytes.data() + element * accessor.stride, sizeof values);
  return values;
}

/// Three components of an element, of integers as fractions of their largest value.
glm::dvec3 values_at(const Accessor& accessor, std::uint64_t element) {
  if (accessor.has(Component::byte)) {
    const auto [x, y, z] = components_at<std::uint8_t>(accessor, element);
    return glm::dvec3(x, y, z) / 255.0;
  }
  if (accessor.has(Component::int16)) {
    const auto [x, y, z] = components_at<std::uint16_t>(accessor, element);
    return glm::dvec3(x, y, z) / 65535.0;
  }
  const auto [x, y, z] = components_at<float>(accessor, element);
  return {x, y, z};
}

/// None: the attribute is absent.
std::optional<Accessor> accessor_of(Accessors& accessors, const Json& attributes, const char* name,
                                    const Accessor& positions, const std::string& place) {
  if (member(attributes, name) == nullptr) return std::nullopt;
  Accessor found = accessors.at(whole(attributes, name, place), place + ": its " + name);
  if (found.count != positions.count)
    refuse(place + ": the count of its " + name + " (" + found.name + ") is " + number(found.count) +
           ", and the count of positions (" + positions.name + ") is " + number(positions.count));
  return found;
}

void check_finite(const Accessor& accessor, const char* name, const std::string& place) {
  for (std::uint64_t k = 0; k < accessor.count; ++k) {
    const glm::dvec3 value = values_at(accessor, k);
    if (!std::isfinite(value.x) || !std::isfinite(value.y) || !std::isfinite(value.z))
      refuse(place + ": " + name + " " + number(k) + " (" + accessor.name + ") is " + rtstdb::text_of(value) +
             ", which is not finite");
  }
}

}  // namespace

CornerAccessors::CornerAccessors(Accessors& accessors, const Json& attributes, const Accessor& positions,
                                 const std::string& place)
    : normals_(accessor_of(accessors, attributes, "NORMAL", positions, place)),
      colors_(accessor_of(accessors, attributes, "COLOR_0", positions, place)) {
  const auto types = [](const Accessor& found) {
    return " (" + found.name + ") are " + found.type + " of component type " + number(found.component);
  };
  if (normals_) {
    if (!normals_->has(Component::float32) || normals_->type != "VEC3")
      refuse(place + ": its normals" + types(*normals_) + "; VEC3 of component type 5126 (float) is allowed");
    check_finite(*normals_, "NORMAL", place);
  }
  if (colors_) {
    const bool is_integer = colors_->has(Component::byte) || colors_->has(Component::int16);
    const bool is_color = (is_integer && colors_->normalized) || colors_->has(Component::float32);
    if (!is_color || (colors_->type != "VEC3" && colors_->type != "VEC4"))
      refuse(place + ": its colours" + types(*colors_) +
             (is_integer && !colors_->normalized ? ", not normalized" : "") +
             "; VEC3 or VEC4 of component type 5126 (float), or 5121 or 5123 and normalized, is allowed");
    check_finite(*colors_, "COLOR_0", place);
  }
}

glm::dvec3 CornerAccessors::normal(std::uint64_t vertex) const {
  return values_at(*normals_, vertex);
}

glm::dvec3 CornerAccessors::color(std::uint64_t vertex) const {
  return glm::clamp(values_at(*colors_, vertex), 0.0, 1.0);
}

}  // namespace rtstdb::gltf
