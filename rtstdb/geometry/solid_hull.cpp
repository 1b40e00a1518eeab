#include "rtstdb/geometry/solid_hull.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/hull_faces.hpp"
#include "rtstdb/geometry/mesh_surface.hpp"
#include "rtstdb/geometry/value_text.hpp"

namespace rtstdb {
namespace {

/// Points of a solid's surface at which its distance from the mesh is tested.
constexpr int solid_test_points = 256;
/// Corners of the polygon that stands for a cap of a cylinder.
constexpr std::uint32_t rim_corners = 32;

bool has_height(SolidKind kind) {
  return kind == SolidKind::capsule || kind == SolidKind::cylinder;
}

/// Half the edge lengths of its core: of the box, of the segment of a capsule or a cylinder; 0 of a sphere.
glm::dvec3 core_half_m(const Solid& solid) {
  if (solid.kind == SolidKind::box) return 0.5 * solid.size_m;
  return {0.0, 0.0, has_height(solid.kind) ? 0.5 * solid.height_m : 0.0};
}

/// The distance of a point in the solid's frame from its surface; negative inside.
double signed_distance_m(const Solid& solid, const glm::dvec3& p_m) {
  // A cylinder as a rectangle in the half plane beside its axis.
  const bool is_cylinder = solid.kind == SolidKind::cylinder;
  const glm::dvec3 from_axis = is_cylinder ? glm::dvec3(std::hypot(p_m.x, p_m.y), 0.0, p_m.z) : p_m;
  const glm::dvec3 half_m =
      is_cylinder ? glm::dvec3(solid.radius_m, 0.0, 0.5 * solid.height_m) : core_half_m(solid);
  const glm::dvec3 beyond = glm::abs(from_axis) - half_m;
  const bool is_round = solid.kind == SolidKind::sphere || solid.kind == SolidKind::capsule;
  const double outside_m = glm::length(glm::max(beyond, glm::dvec3(0.0)));
  if (is_round) return outside_m - solid.radius_m;
  const double nearest_m =
      is_cylinder ? std::max(beyond.x, beyond.z) : std::max({beyond.x, beyond.y, beyond.z});
  return outside_m + std::min(nearest_m, 0.0);
}

/// Directions spread over the sphere (a spiral by the golden angle).
glm::dvec3 direction(int i) {
  const double z = 1.0 - (2.0 * i + 1.0) / solid_test_points;
  const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// The point of the surface in a direction from the centre.
glm::dvec3 surface_point(const Solid& solid, const glm::dvec3& d) {
  double inside = 0.0;
  double outside = glm::length(core_half_m(solid)) + 2.0 * solid.radius_m;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (inside + outside);
    (signed_distance_m(solid, middle * d) < 0.0 ? inside : outside) = middle;
  }
  return inside * d;
}

Error refused(const Solid& solid, const std::string& fault) {
  return {ErrorCode::bad_input, std::string("the ") + to_string(solid.kind) + " " + fault};
}

/// Empty: kind and sizes of the solid are valid.
std::string fault_of_values(const Solid& solid) {
  if (solid.kind > SolidKind::cylinder)
    return "has the kind " + std::to_string(static_cast<int>(solid.kind)) +
           ", which is none of the enumerators";
  const auto is_size = [](double value) { return std::isfinite(value) && value > 0.0; };
  if (solid.kind == SolidKind::box) {
    if (!is_size(solid.size_m.x) || !is_size(solid.size_m.y) || !is_size(solid.size_m.z))
      return "has the size " + text_of(solid.size_m) + "; positive numbers are needed";
  } else if (!is_size(solid.radius_m)) {
    return "has the radius " + metres(solid.radius_m) + "; a positive number is needed";
  }
  if (has_height(solid.kind) && !is_size(solid.height_m))
    return "has the height " + metres(solid.height_m) + "; a positive number is needed";
  if (!(glm::length(solid.center_m) < std::numeric_limits<double>::infinity()))
    return "has the centre " + text_of(solid.center_m) + ", which is not finite";
  if (!(std::abs(glm::length(solid.q_entity) - 1.0) <= 1e-6)) return "has a rotation that is not of length 1";
  return {};
}

/// Empty: mesh and solid deviate from each other by at most the tolerance.
std::string fault_of_mesh(const MeshView& mesh, const Solid& solid) {
  const auto corner_m = [&](std::uint32_t index) { return glm::dvec3(mesh.positions_m[index]); };
  const double allowed_m = solid_tolerance * diagonal_m(box_of(mesh));
  const glm::dquat to_solid = glm::conjugate(solid.q_entity);
  const std::string limit = "; at most " + metres(allowed_m) + " are allowed";
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = corner_m(t.x), b = corner_m(t.y), c = corner_m(t.z);
    for (const glm::dvec3& p_m : {a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0}) {
      const double off_m = std::abs(signed_distance_m(solid, to_solid * (p_m - solid.center_m)));
      if (off_m > allowed_m)
        return "is " + metres(off_m) + " off the mesh at the mesh's point " + text_of(p_m) + limit;
    }
  }
  for (int i = 0; i < solid_test_points; ++i) {
    const glm::dvec3 p_m = solid.center_m + solid.q_entity * surface_point(solid, direction(i));
    const double nearest_m = distance_to_mesh_m(mesh, p_m);
    if (nearest_m > allowed_m)
      return "is " + metres(nearest_m) + " off the mesh at its point " + text_of(p_m) + limit;
  }
  return {};
}

/// A face with the same corners as the edge of a cap.
void add_cap(ConvexHull& hull, const Solid& solid, double side) {
  ConvexHull::Face face{.normal = glm::vec3(solid.q_entity * glm::dvec3(0.0, 0.0, side)),
                        .first_corner = static_cast<std::uint32_t>(hull.face_corners.size()),
                        .corner_count = rim_corners};
  for (std::uint32_t i = 0; i < face.corner_count; ++i) {
    const double angle = side * 2.0 * std::numbers::pi * i / face.corner_count;
    const glm::dvec3 p_m(solid.radius_m * std::cos(angle), solid.radius_m * std::sin(angle),
                         0.5 * side * solid.height_m);
    hull.face_corners.push_back(static_cast<std::uint32_t>(hull.corners_m.size()));
    hull.corners_m.emplace_back(solid.center_m + solid.q_entity * p_m);
  }
  hull.faces.push_back(face);
}

/// Corner i is on the positive side of axis k if bit k of i is set.
ConvexHull box_hull(const Solid& solid) {
  ConvexHull hull;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const glm::dvec3 side(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    hull.corners_m.emplace_back(solid.center_m + solid.q_entity * (side * solid.size_m));
  }
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t along = 1u << axis, u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      glm::dvec3 normal(0.0);
      normal[static_cast<int>(axis)] = side;
      hull.faces.push_back({.normal = glm::vec3(solid.q_entity * normal),
                            .first_corner = static_cast<std::uint32_t>(hull.face_corners.size()),
                            .corner_count = 4});
      if (side > 0.0)
        hull.face_corners.insert(hull.face_corners.end(), {along, along | u, along | u | v, along | v});
      else
        hull.face_corners.insert(hull.face_corners.end(), {0u, v, u | v, u});
    }
  }
  set_box(hull, hull.corners_m);
  return hull;
}

ConvexHull round_hull(const Solid& solid) {
  ConvexHull hull;
  const glm::dvec3 along_m = solid.q_entity * core_half_m(solid);
  hull.corners_m.emplace_back(solid.center_m - along_m);
  if (has_height(solid.kind)) hull.corners_m.emplace_back(solid.center_m + along_m);
  const bool is_cylinder = solid.kind == SolidKind::cylinder;
  const glm::dvec3 axis = solid.q_entity * glm::dvec3(0.0, 0.0, 1.0);
  hull.round = {.axis = is_cylinder ? glm::vec3(axis) : glm::vec3(0.0f),
                .radius_m = static_cast<float>(solid.radius_m),
                .core_corners = static_cast<std::uint32_t>(hull.corners_m.size())};
  const glm::dvec3 around =
      is_cylinder ? glm::sqrt(glm::max(glm::dvec3(1.0) - axis * axis, glm::dvec3(0.0))) : glm::dvec3(1.0);
  hull.center_m = glm::vec3(solid.center_m);
  hull.half_extent_m = glm::vec3(glm::abs(along_m) + solid.radius_m * around);
  if (is_cylinder) {
    add_cap(hull, solid, 1.0);
    add_cap(hull, solid, -1.0);
  }
  return hull;
}

}  // namespace

const char* to_string(SolidKind kind) noexcept {
  switch (kind) {
    case SolidKind::box:
      return "box";
    case SolidKind::sphere:
      return "sphere";
    case SolidKind::capsule:
      return "capsule";
    case SolidKind::cylinder:
      return "cylinder";
  }
  return "solid";
}

Result<ConvexHull> solid_hull(const MeshView& mesh, const Solid& solid) {
  if (const std::string fault = fault_of_values(solid); !fault.empty()) return refused(solid, fault);
  if (const std::string fault = fault_of_mesh(mesh, solid); !fault.empty()) return refused(solid, fault);
  return recovered_solid_hull(mesh, solid);
}

ConvexHull recovered_solid_hull(const MeshView& mesh, const Solid& solid) {
  ConvexHull hull = solid.kind == SolidKind::box ? box_hull(solid) : round_hull(solid);
  // Contact points name the nearest of all triangles of the mesh.
  hull.face_triangles.clear();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    hull.face_triangles.push_back(t);
  for (ConvexHull::Face& face : hull.faces)
    face.first_triangle = face.triangle_count = 0;
  return hull;
}

TriangleMesh with_points_of_parts(const MeshView& mesh, const ConvexParts& parts) {
  TriangleMesh result{.positions_m = {mesh.positions_m.begin(), mesh.positions_m.end()},
                      .triangles = {mesh.triangles.begin(), mesh.triangles.end()}};
  const auto add_point = [&](const glm::vec3& p_m) {
    const auto index = static_cast<std::uint32_t>(result.positions_m.size());
    result.positions_m.push_back(p_m);
    result.triangles.emplace_back(index);
  };
  for (const ConvexHull& hull : parts) {
    for (const glm::vec3& corner_m : hull.corners_m)
      add_point(corner_m);
    if (!hull.round) continue;
    for (int i = 0; i < 27; ++i) {
      const glm::vec3 d(glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1);
      const glm::vec3 across = d - hull.round->axis * glm::dot(hull.round->axis, d);
      if (!(glm::length(across) > 1e-6f)) continue;
      for (const glm::vec3& corner_m : std::span(hull.corners_m).first(hull.round->core_corners))
        add_point(corner_m + 1.000001f * hull.round->radius_m * glm::normalize(across));
    }
  }
  return result;
}

}  // namespace rtstdb
