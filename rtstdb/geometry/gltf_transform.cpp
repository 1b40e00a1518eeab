#include "rtstdb/geometry/gltf_transform.hpp"

#include <glm/geometric.hpp>

#include <cmath>
#include <optional>

namespace rtstdb::gltf {
namespace {

template <std::size_t size>
std::optional<std::array<double, size>> numbers(const Json& node, std::string_view name,
                                                const std::string& place) {
  const Json* list = member(node, name);
  if (list == nullptr) return std::nullopt;
  const std::string what = place + ": its " + std::string(name);
  if (!list->is_array()) refuse(what + " is not an array of " + number(size) + " numbers");
  if (list->size() != size)
    refuse(what + " needs " + number(size) + " numbers, and the count of those given is " +
           number(list->size()));
  std::array<double, size> values{};
  for (std::size_t k = 0; k < size; ++k) {
    const Json& value = (*list)[k];
    if (!value.is_number()) refuse(what + ": element " + number(k) + " is not a number");
    values[k] = value.get<double>();
  }
  return values;
}

/// Column by column, as glTF stores it.
Affine from_matrix(const std::array<double, 16>& m, const std::string& place) {
  constexpr double tolerance = 1e-5;  // files hold floats
  const bool is_affine = std::abs(m[3]) <= tolerance && std::abs(m[7]) <= tolerance &&
                         std::abs(m[11]) <= tolerance && std::abs(m[15] - 1.0) <= tolerance;
  if (!is_affine) refuse(place + ": the last row of its matrix is not 0, 0, 0, 1");
  return {{{{m[0], m[4], m[8], m[12]}, {m[1], m[5], m[9], m[13]}, {m[2], m[6], m[10], m[14]}}}};
}

using Rotation = std::array<std::array<double, 3>, 3>;

Rotation rotation_of(const std::array<double, 4>& q, const std::string& place) {
  constexpr double tolerance = 0.01;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1.0) <= tolerance))
    refuse(place + ": its rotation has the length " + std::to_string(length) +
           ", and a rotation is a unit quaternion");
  const double x = q[0] / length, y = q[1] / length, z = q[2] / length, w = q[3] / length;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

}  // namespace

glm::dvec3 Affine::transformed(const glm::dvec3& point) const {
  const auto row = [&](std::size_t r) {
    return rows[r][0] * point.x + rows[r][1] * point.y + rows[r][2] * point.z + rows[r][3];
  };
  return {row(0), row(1), row(2)};
}

glm::dvec3 Affine::transformed_normal(const glm::dvec3& normal) const {
  const auto row = [&](std::size_t r) { return glm::dvec3(rows[r][0], rows[r][1], rows[r][2]); };
  // The cofactors are the inverse transpose times the determinant, and exist without an inverse.
  const glm::dvec3 turned(glm::dot(glm::cross(row(1), row(2)), normal),
                          glm::dot(glm::cross(row(2), row(0)), normal),
                          glm::dot(glm::cross(row(0), row(1)), normal));
  return mirrors() ? -turned : turned;
}

bool Affine::mirrors() const {
  const auto& [a, b, c] = rows;
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
             a[2] * (b[0] * c[1] - b[1] * c[0]) <
         0.0;
}

Affine operator*(const Affine& parent, const Affine& child) {
  Affine product;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      product.rows[r][c] = c == 3 ? parent.rows[r][3] : 0.0;
      for (std::size_t k = 0; k < 3; ++k)
        product.rows[r][c] += parent.rows[r][k] * child.rows[k][c];
    }
  }
  return product;
}

Affine node_to_parent(const Json& node, const std::string& place) {
  if (const auto matrix = numbers<16>(node, "matrix", place)) return from_matrix(*matrix, place);
  const auto offset = numbers<3>(node, "translation", place).value_or(std::array{0.0, 0.0, 0.0});
  const auto scale = numbers<3>(node, "scale", place).value_or(std::array{1.0, 1.0, 1.0});
  const auto q = numbers<4>(node, "rotation", place).value_or(std::array{0.0, 0.0, 0.0, 1.0});
  const Rotation turn = rotation_of(q, place);
  Affine to_parent;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c)
      to_parent.rows[r][c] = turn[r][c] * scale[c];
    to_parent.rows[r][3] = offset[r];
  }
  return to_parent;
}

}  // namespace rtstdb::gltf
