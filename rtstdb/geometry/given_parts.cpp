#include "rtstdb/geometry/given_parts.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/hull_triangles.hpp"
#include "rtstdb/geometry/mesh_surface.hpp"
#include "rtstdb/geometry/point_hull.hpp"
#include "rtstdb/geometry/value_text.hpp"

namespace rtstdb {
namespace {

Error bad_part(std::size_t part, const std::string& fault) {
  return {ErrorCode::bad_input, "convex part " + std::to_string(part) + " " + fault};
}

/// How far a point is in front of the face that it is farthest in front of; not above 0: in the hull.
double height_above_m(const ConvexHull& hull, const glm::dvec3& p_m) {
  double height_m = -std::numeric_limits<double>::infinity();
  for (const ConvexHull::Face& face : hull.faces) {
    const glm::vec3& corner = hull.corners_m[hull.face_corners[face.first_corner]];
    height_m = std::max(height_m, glm::dot(glm::dvec3(face.normal), p_m - glm::dvec3(corner)));
  }
  return height_m;
}

glm::dvec3 center_of(const MeshView& mesh, std::uint32_t triangle) {
  const Corners corners_m = corners_of(mesh, triangle);
  return (corners_m[0] + corners_m[1] + corners_m[2]) / 3.0;
}

glm::dvec3 center_of(const ConvexHull& hull, const ConvexHull::Face& face) {
  glm::dvec3 sum(0.0);
  for (std::uint32_t i = 0; i < face.corner_count; ++i)
    sum += glm::dvec3(hull.corners_m[hull.face_corners[face.first_corner + i]]);
  return sum / static_cast<double>(face.corner_count);
}

/// A face of one of the hulls.
struct FaceOfPart {
  std::size_t part = 0, face = 0;
  glm::dvec3 center_m{0.0};
  std::vector<std::uint32_t> triangles;  ///< of the mesh
};

/// Replaces the triangles of the hulls' own meshes by triangles of the geometry's mesh.
void name_triangles(const MeshView& mesh, ConvexParts& hulls) {
  std::vector<FaceOfPart> faces;
  for (std::size_t part = 0; part < hulls.size(); ++part)
    for (std::size_t face = 0; face < hulls[part].faces.size(); ++face)
      faces.push_back({part, face, center_of(hulls[part], hulls[part].faces[face]), {}});
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::dvec3 center_m = center_of(mesh, t);
    std::ranges::min_element(faces, {}, [&](const FaceOfPart& face) {
      return glm::distance(face.center_m, center_m);
    })->triangles.push_back(t);
  }
  for (ConvexHull& hull : hulls)
    hull.face_triangles.clear();
  for (FaceOfPart& of_part : faces) {
    ConvexHull& hull = hulls[of_part.part];
    if (of_part.triangles.empty()) {
      std::uint32_t nearest = 0;
      for (std::uint32_t t = 1; t < mesh.triangles.size(); ++t)
        if (glm::distance(center_of(mesh, t), of_part.center_m) <
            glm::distance(center_of(mesh, nearest), of_part.center_m))
          nearest = t;
      of_part.triangles.push_back(nearest);
    }
    ConvexHull::Face& face = hull.faces[of_part.face];
    face.first_triangle = static_cast<std::uint32_t>(hull.face_triangles.size());
    face.triangle_count = static_cast<std::uint32_t>(of_part.triangles.size());
    hull.face_triangles.insert(hull.face_triangles.end(), of_part.triangles.begin(), of_part.triangles.end());
  }
}

/// Whether the hull, enlarged by a length, contains the point.
bool contains(const ConvexHull& hull, const glm::dvec3& p_m, double larger_m) {
  const glm::dvec3 beyond_m = glm::abs(p_m - glm::dvec3(hull.center_m)) - glm::dvec3(hull.half_extent_m);
  if (std::max({beyond_m.x, beyond_m.y, beyond_m.z}) > larger_m) return false;
  return height_above_m(hull, p_m) <= larger_m;
}

/// Empty: no point of the mesh is too far outside all parts.
std::string fault_of_mesh(const MeshSurface& surface, const ConvexParts& hulls, double allowed_m) {
  for (const glm::dvec3& p_m : surface.samples_m()) {
    if (std::ranges::any_of(hulls, [&](const auto& hull) { return contains(hull, p_m, allowed_m); }))
      continue;
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const ConvexHull& hull : hulls)
      nearest_m = std::min(nearest_m, height_above_m(hull, p_m));
    return "the mesh's point " + text_of(p_m) + " is " + metres(nearest_m) +
           " outside all convex parts; at most " + metres(allowed_m) + " are allowed";
  }
  return {};
}

/// Empty: no point of the part's surface is too far outside the mesh. Points inside another part do not
/// count: that part's own surface does.
std::string fault_of_part(const MeshView& mesh, const MeshSurface& surface, const ConvexParts& hulls,
                          std::size_t part, double allowed_m) {
  const ConvexHull& hull = hulls[part];
  for (const ConvexHull::Face& face : hull.faces) {
    const auto corner_m = [&](std::uint32_t i) {
      return glm::dvec3(hull.corners_m[hull.face_corners[face.first_corner + i]]);
    };
    std::vector<glm::dvec3> points_m;
    for (std::uint32_t i = 2; i < face.corner_count; ++i)
      append_samples({corner_m(0), corner_m(i - 1), corner_m(i)}, 0.5 * allowed_m, points_m);
    for (const glm::dvec3& p_m : points_m) {
      if (surface.is_within_reach(p_m)) continue;
      const glm::dvec3 above_m = p_m + 1e-3 * allowed_m * glm::dvec3(face.normal);
      bool is_inside_another = false;
      for (std::size_t i = 0; i < hulls.size() && !is_inside_another; ++i)
        is_inside_another = i != part && contains(hulls[i], above_m, 0.0);
      if (is_inside_another || std::abs(surface.winding_number(p_m)) >= 0.5) continue;
      return "has the point " + text_of(p_m) + ", which is " + metres(distance_to_mesh_m(mesh, p_m)) +
             " outside the mesh; at most " + metres(allowed_m) + " are allowed";
    }
  }
  return {};
}

}  // namespace

Result<ConvexParts> given_convex_parts(const MeshView& mesh, const ConvexPartPoints& parts_m) {
  if (parts_m.size() > max_convex_parts)
    return Error{ErrorCode::bad_input, std::to_string(parts_m.size()) + " convex parts; 1 to " +
                                           std::to_string(max_convex_parts) + " are allowed"};
  const Bounds box = box_of(mesh);
  const double allowed_m = convex_parts_tolerance * diagonal_m(box);
  ConvexParts hulls;
  for (std::size_t part = 0; part < parts_m.size(); ++part) {
    const std::vector<glm::vec3>& points_m = parts_m[part];
    if (points_m.size() > max_convex_part_points)
      return bad_part(part, "has " + std::to_string(points_m.size()) + " points; at most " +
                                std::to_string(max_convex_part_points) + " are allowed");
    for (const glm::vec3& p_m : points_m) {
      if (!std::isfinite(p_m.x) || !std::isfinite(p_m.y) || !std::isfinite(p_m.z))
        return bad_part(part, "has the point " + text_of(p_m) + ", which is not finite");
      // So that the samples of its surface, in fault_of_part, are few.
      const glm::dvec3 beyond_m =
          glm::max(glm::dvec3(box.minimum_m) - glm::dvec3(p_m), glm::dvec3(p_m) - glm::dvec3(box.maximum_m));
      const double outside_m = std::max({beyond_m.x, beyond_m.y, beyond_m.z});
      if (outside_m > allowed_m)
        return bad_part(part, "has the point " + text_of(p_m) + ", which is " + metres(outside_m) +
                                  " outside the box of the mesh; at most " + metres(allowed_m) +
                                  " are allowed");
    }
    if (const auto checked = checked_hull(points_m); !checked)
      return bad_part(part, "has " + checked.error().message);
    hulls.push_back(convex_hull_of_points(points_m).value());
  }
  const MeshSurface surface(mesh, allowed_m);
  if (std::string fault = fault_of_mesh(surface, hulls, allowed_m); !fault.empty())
    return Error{ErrorCode::bad_input, std::move(fault)};
  for (std::size_t part = 0; part < hulls.size(); ++part) {
    const std::string fault = fault_of_part(mesh, surface, hulls, part, allowed_m);
    if (!fault.empty()) return bad_part(part, fault);
  }
  name_triangles(mesh, hulls);
  return hulls;
}

ConvexParts recovered_convex_parts(const MeshView& mesh, const ConvexPartPoints& parts_m) {
  ConvexParts hulls;
  for (const std::vector<glm::vec3>& points_m : parts_m) {
    auto hull = convex_hull_of_points(points_m);
    if (!hull) return convex_parts_of(mesh);
    hulls.push_back(std::move(*hull));
  }
  name_triangles(mesh, hulls);
  return hulls;
}

}  // namespace rtstdb
