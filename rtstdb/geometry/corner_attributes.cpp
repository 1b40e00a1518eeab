#include "rtstdb/geometry/corner_attributes.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace rtstdb {
namespace {

constexpr CornerValues without_normals{glm::vec3(0.0f), glm::vec3(0.0f), glm::vec3(0.0f)};
constexpr CornerValues white{glm::vec3(1.0f), glm::vec3(1.0f), glm::vec3(1.0f)};

void set_last(const TriangleMesh& mesh, std::vector<CornerValues>& values, const CornerValues& others,
              const CornerValues& last) {
  values.resize(mesh.triangles.size() - 1, others);
  values.push_back(last);
}

/// +z for a triangle without area.
glm::vec3 normal_of(const TriangleMesh& mesh, const glm::uvec3& triangle) {
  const glm::dvec3 a(mesh.positions_m[triangle.x]);
  const glm::dvec3 b(mesh.positions_m[triangle.y]);
  const glm::dvec3 c(mesh.positions_m[triangle.z]);
  const glm::dvec3 normal = unit_or_zero(glm::cross(b - a, c - a));
  return normal == glm::dvec3(0.0) ? glm::vec3(0.0f, 0.0f, 1.0f) : glm::vec3(normal);
}

bool is_finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool is_normal(const glm::vec3& v) {
  return is_finite(v) && v != glm::vec3(0.0f);
}

bool is_color(const glm::vec3& v) {
  return v.x >= 0.0f && v.x <= 1.0f && v.y >= 0.0f && v.y <= 1.0f && v.z >= 0.0f && v.z <= 1.0f;
}

Result<void> check_values(const TriangleMesh& mesh, const std::vector<CornerValues>& values, const char* name,
                          const char* allowed, bool (*is_valid)(const glm::vec3&)) {
  if (values.empty()) return {};
  if (values.size() != mesh.triangles.size())
    return Error{ErrorCode::bad_input, std::string("the mesh has corner ") + name + "s for " +
                                           std::to_string(values.size()) +
                                           " triangles, and the count of its triangles is " +
                                           std::to_string(mesh.triangles.size())};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto fault = std::ranges::find_if_not(values[i], is_valid);
    if (fault == values[i].end()) continue;
    char text[160];
    std::snprintf(text, sizeof text, "(%.9g, %.9g, %.9g), which is %s", static_cast<double>(fault->x),
                  static_cast<double>(fault->y), static_cast<double>(fault->z),
                  is_finite(*fault) ? allowed : "not finite");
    return Error{ErrorCode::bad_input, "triangle " + std::to_string(i) + " has at its corner " +
                                           std::to_string(fault - values[i].begin()) + " the " + name + " " +
                                           text};
  }
  return {};
}

}  // namespace

glm::dvec3 unit_or_zero(const glm::dvec3& vector) noexcept {
  const glm::dvec3 size = glm::abs(vector);
  const double largest = std::max({size.x, size.y, size.z});
  if (!std::isfinite(size.x + size.y + size.z) || largest == 0.0) return glm::dvec3(0.0);
  return glm::normalize(vector / largest);
}

void set_last_normals(TriangleMesh& mesh, const CornerValues& normals) {
  if (mesh.corner_normals.empty() && normals == without_normals) return;
  set_last(mesh, mesh.corner_normals, without_normals, normals);
}

void set_last_colors(TriangleMesh& mesh, const CornerValues& colors) {
  set_last(mesh, mesh.corner_colors, white, colors);
}

void complete_corner_attributes(TriangleMesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  if (!mesh.corner_colors.empty()) mesh.corner_colors.resize(count, white);
  if (mesh.corner_normals.empty()) return;
  mesh.corner_normals.resize(count, without_normals);
  for (std::size_t i = 0; i < count; ++i) {
    for (glm::vec3& normal : mesh.corner_normals[i]) {
      const glm::dvec3 unit = unit_or_zero(glm::dvec3(normal));
      normal = unit == glm::dvec3(0.0) ? normal_of(mesh, mesh.triangles[i]) : glm::vec3(unit);
    }
  }
}

Result<void> check_corner_attributes(const TriangleMesh& mesh) {
  if (auto valid =
          check_values(mesh, mesh.corner_normals, "normal", "of length zero and has no direction", is_normal);
      !valid)
    return valid;
  return check_values(mesh, mesh.corner_colors, "colour", "outside 0 to 1", is_color);
}

}  // namespace rtstdb
