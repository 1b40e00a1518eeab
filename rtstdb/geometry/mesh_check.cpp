#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/corner_attributes.hpp"
#include "rtstdb/geometry/given_parts.hpp"
#include "rtstdb/geometry/has_area.hpp"
#include "rtstdb/geometry/mesh_surface.hpp"
#include "rtstdb/geometry/solid_hull.hpp"

namespace rtstdb {
namespace {

std::string describe(const glm::vec3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.9g, %.9g, %.9g)", static_cast<double>(p.x), static_cast<double>(p.y),
                static_cast<double>(p.z));
  return text;
}

std::string number(std::size_t n) {
  return std::to_string(n);
}

/// The fault of a position; none: it is valid.
std::optional<std::string> fault_of(const glm::vec3& p) {
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
    return describe(p) + ", which is not finite";
  const double largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  if (largest <= max_coordinate_m) return std::nullopt;
  char text[160];
  std::snprintf(text, sizeof text, "%s, which is beyond the limit of %.9g m", describe(p).c_str(),
                max_coordinate_m);
  return text;
}

Result<void> refuse(std::string message) {
  return Error{ErrorCode::bad_input, std::move(message)};
}

Result<void> check_triangles(const TriangleMesh& mesh) {
  const std::size_t count = mesh.positions_m.size();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t index = mesh.triangles[i][corner];
      if (index >= count)
        return refuse("triangle " + number(i) + " has corner index " + number(index) +
                      ", and the count of positions is " + number(count));
      if (const auto fault = fault_of(mesh.positions_m[index]))
        return refuse("triangle " + number(i) + " has corner " + number(index) + " at " + *fault);
    }
  }
  return {};
}

/// Whether all triangles and positions are valid, without the fault. Uses loops without branches, since
/// nearly all meshes are valid.
bool is_in_range(const TriangleMesh& mesh) {
  constexpr auto largest = static_cast<float>(max_coordinate_m);
  static_assert(static_cast<double>(largest) == max_coordinate_m);
  bool right = true;
  for (const glm::vec3& p : mesh.positions_m)
    right &= (std::abs(p.x) <= largest) & (std::abs(p.y) <= largest) & (std::abs(p.z) <= largest);
  std::uint32_t highest = 0;
  for (const glm::uvec3& triangle : mesh.triangles)
    highest = std::max({highest, triangle.x, triangle.y, triangle.z});
  return right && highest < mesh.positions_m.size();
}

/// The first fault of an invalid mesh.
Result<void> check_each(const TriangleMesh& mesh) {
  if (Result<void> checked = check_triangles(mesh); !checked) return checked;
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i) {
    if (const auto fault = fault_of(mesh.positions_m[i]))
      return refuse("position " + number(i) + ", which no triangle uses, is at " + *fault);
  }
  return {};
}

bool has_area(const TriangleMesh& mesh, const glm::uvec3& triangle) {
  return rtstdb::has_area(mesh.positions_m[triangle.x], mesh.positions_m[triangle.y],
                          mesh.positions_m[triangle.z]);
}

}  // namespace

Result<void> validate(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return refuse("the mesh has no triangle");
  if (mesh.triangles.size() > max_triangles_total)
    return Error{ErrorCode::capacity, "the mesh has " + number(mesh.triangles.size()) +
                                          " triangles, and the limit is " + number(max_triangles_total)};
  if (!is_in_range(mesh)) {
    if (Result<void> checked = check_each(mesh); !checked) return checked;
  }
  if (Result<void> checked = check_corner_attributes(mesh); !checked) return checked;
  const bool some_area =
      std::any_of(mesh.triangles.begin(), mesh.triangles.end(),
                  [&mesh](const glm::uvec3& triangle) { return has_area(mesh, triangle); });
  if (some_area) return {};
  const glm::uvec3& first = mesh.triangles.front();
  return refuse("every triangle (count " + number(mesh.triangles.size()) +
                ") is degenerate, triangle 0 with corners " + describe(mesh.positions_m[first.x]) + ", " +
                describe(mesh.positions_m[first.y]) + ", " + describe(mesh.positions_m[first.z]));
}

Result<void> validate(const TriangleMesh& mesh, const GeometryOptions& options) {
  if (Result<void> valid = validate(mesh); !valid) return valid;
  if (options.solid) {
    if (const auto hull = solid_hull(mesh, *options.solid); !hull) return hull.error();
  }
  if (options.convex_parts_m.empty()) return {};
  const auto parts = given_convex_parts(mesh, options.convex_parts_m);
  return parts ? Result<void>() : parts.error();
}

Bounds bounds_of(const TriangleMesh& mesh) {
  RTSTDB_REQUIRE(!mesh.triangles.empty(), "bounds_of", "the mesh has no triangle; call validate first");
  return box_of(mesh);
}

}  // namespace rtstdb
