#include "rtstdb/geometry/extents.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>

#include <rtstdb/result.hpp>

namespace rtstdb {
namespace {

/// Triangles processed side by side. The compiler unrolls shorter loops instead of vectorising them.
constexpr std::size_t lanes = 32;
using Lanes = std::array<float, lanes>;

/// Extents of boxes along +x, -x, +y, -y, +z, -z.
using Faces = std::array<Lanes, 6>;

/// Extents along the edges and corners of a cube, in the order of Extents.
template <class Value>
struct Between {
  std::array<std::array<Value, 4>, 3> edges;
  std::array<Value, 8> corners;
};

Lanes operator+(const Lanes& a, const Lanes& b) noexcept {
  Lanes sums;
  for (std::size_t i = 0; i < lanes; ++i)
    sums[i] = a[i] + b[i];
  return sums;
}

void keep_most(Lanes& most, const Lanes& other) noexcept {
  for (std::size_t i = 0; i < lanes; ++i)
    most[i] = most[i] < other[i] ? other[i] : most[i];
}

/// The bounds of the triangles from `first` on; beyond the last triangle, those of the last are repeated.
Faces faces_of(const MeshView& mesh, std::size_t first) noexcept {
  Faces faces;
  for (std::size_t i = 0; i < lanes; ++i) {
    const glm::uvec3& triangle = mesh.triangles[std::min(first + i, mesh.triangles.size() - 1)];
    const glm::vec3& a = mesh.positions_m[triangle.x];
    const glm::vec3& b = mesh.positions_m[triangle.y];
    const glm::vec3& c = mesh.positions_m[triangle.z];
    const glm::vec3 low_m = glm::min(a, glm::min(b, c));
    const glm::vec3 high_m = glm::max(a, glm::max(b, c));
    for (int axis = 0; axis < 3; ++axis) {
      const auto face = 2 * static_cast<std::size_t>(axis);
      faces[face][i] = high_m[axis];
      faces[face + 1][i] = -low_m[axis];
    }
  }
  return faces;
}

void take_between(const Faces& faces, Between<Lanes>& most) noexcept {
  for (std::size_t signs = 0; signs < 4; ++signs) {
    const std::size_t first = signs >> 1;
    const std::size_t second = signs & 1;
    const Lanes without_x = faces[2 + first] + faces[4 + second];
    keep_most(most.edges[0][signs], without_x);
    keep_most(most.edges[1][signs], faces[first] + faces[4 + second]);
    keep_most(most.edges[2][signs], faces[first] + faces[2 + second]);
    keep_most(most.corners[signs], faces[0] + without_x);
    keep_most(most.corners[4 + signs], faces[1] + without_x);
  }
}

Extents seen_from_middle(const Bounds& bounds, const Between<double>& most) noexcept {
  const glm::dvec3 minimum_m(bounds.minimum_m);
  const glm::dvec3 maximum_m(bounds.maximum_m);
  const glm::dvec3 middle_m = 0.5 * (minimum_m + maximum_m);
  // Adds an upper bound of the rounding error of the additions and of this conversion.
  constexpr double unit = std::numeric_limits<float>::epsilon();
  const double rounding_m =
      4.0 * unit * glm::dot(glm::max(glm::abs(minimum_m), glm::abs(maximum_m)), glm::dvec3(1.0));
  const auto middle_along = [&](int axis, std::size_t sign) {
    return sign == 0 ? middle_m[axis] : -middle_m[axis];
  };
  const auto beyond = [&](double max_m, double middle) {
    return static_cast<float>(max_m - middle + rounding_m);
  };
  Extents extents{.bounds = bounds, .edges = {}, .corners = {}};
  for (std::size_t signs = 0; signs < 4; ++signs) {
    const auto element = static_cast<int>(signs);
    for (int axis = 0; axis < 3; ++axis) {
      const auto without = static_cast<std::size_t>(axis);
      const double middle =
          middle_along(axis == 0 ? 1 : 0, signs >> 1) + middle_along(axis == 2 ? 1 : 2, signs & 1);
      extents.edges[without][element] = beyond(most.edges[without][signs], middle);
    }
    const double without_x = middle_along(1, signs >> 1) + middle_along(2, signs & 1);
    extents.corners[0][element] = beyond(most.corners[signs], middle_m.x + without_x);
    extents.corners[1][element] = beyond(most.corners[4 + signs], without_x - middle_m.x);
  }
  return extents;
}

}  // namespace

Extents extents_of(const MeshView& mesh) noexcept {
  RTSTDB_ASSERT(!mesh.triangles.empty(), "the mesh has no triangle");
  Faces most = faces_of(mesh, 0);
  Between<Lanes> max_between;
  const auto clear = [](Lanes& value) { value.fill(std::numeric_limits<float>::lowest()); };
  for (auto& edges : max_between.edges)
    std::ranges::for_each(edges, clear);
  std::ranges::for_each(max_between.corners, clear);
  for (std::size_t first = 0; first < mesh.triangles.size(); first += lanes) {
    const Faces faces = faces_of(mesh, first);
    for (std::size_t face = 0; face < faces.size(); ++face)
      keep_most(most[face], faces[face]);
    take_between(faces, max_between);
  }
  const auto max_of = [](const Lanes& value) { return std::ranges::max(value); };
  Between<double> between;
  for (std::size_t axis = 0; axis < 3; ++axis)
    std::ranges::transform(max_between.edges[axis], between.edges[axis].begin(), max_of);
  std::ranges::transform(max_between.corners, between.corners.begin(), max_of);
  return seen_from_middle({{-max_of(most[1]), -max_of(most[3]), -max_of(most[5])},
                           {max_of(most[0]), max_of(most[2]), max_of(most[4])}},
                          between);
}

Extents extents_of(const Bounds& bounds) noexcept {
  const glm::vec3 half_m = 0.5f * (bounds.maximum_m - bounds.minimum_m);
  return {.bounds = bounds,
          .edges = {glm::vec4(half_m.y + half_m.z), glm::vec4(half_m.x + half_m.z),
                    glm::vec4(half_m.x + half_m.y)},
          .corners = {glm::vec4(half_m.x + half_m.y + half_m.z), glm::vec4(half_m.x + half_m.y + half_m.z)}};
}

double extent_along(const Extents& extents, const glm::dvec3& u) noexcept {
  std::array<int, 3> axes{0, 1, 2};
  std::ranges::sort(axes, std::greater<>(), [&](int axis) { return std::abs(u[axis]); });
  const auto [most, middle, least] = axes;
  const auto negative = [&](int axis) { return u[axis] < 0.0 ? 1 : 0; };
  const int first = least == 0 ? 1 : 0;
  const int second = least == 2 ? 1 : 2;
  const double face = 0.5 * (static_cast<double>(extents.bounds.maximum_m[most]) -
                             static_cast<double>(extents.bounds.minimum_m[most]));
  const double edge = extents.edges[static_cast<std::size_t>(least)][2 * negative(first) + negative(second)];
  const double corner = extents.corners[static_cast<std::size_t>(negative(0))][2 * negative(1) + negative(2)];
  return (std::abs(u[most]) - std::abs(u[middle])) * face +
         (std::abs(u[middle]) - std::abs(u[least])) * edge + std::abs(u[least]) * corner;
}

}  // namespace rtstdb
