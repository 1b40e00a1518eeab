#include "rtstdb/geometry/convex_hull.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/geometry/flat_hull.hpp"
#include "rtstdb/geometry/hull_depth.hpp"
#include "rtstdb/geometry/hull_faces.hpp"
#include "rtstdb/geometry/hull_triangles.hpp"
#include "rtstdb/geometry/mesh_convexity.hpp"
#include "rtstdb/geometry/point_hull.hpp"
#include "rtstdb/geometry/ulp.hpp"
#include "rtstdb/geometry/welded_mesh.hpp"

namespace rtstdb {
namespace {

/// Distributes the triangles of the mesh to the faces of its hull.
void set_face_triangles(ConvexHull& hull, const std::vector<std::vector<std::uint32_t>>& of_faces,
                        const WeldedMesh& mesh) {
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    hull.faces[f].first_triangle = static_cast<std::uint32_t>(hull.face_triangles.size());
    hull.faces[f].triangle_count = static_cast<std::uint32_t>(of_faces[f].size());
    for (const std::uint32_t t : of_faces[f])
      hull.face_triangles.push_back(mesh.numbers[t]);
  }
}

/// Gives faces without a triangle one of the nearest face that has some.
void fill_faces(const HullTriangles& hull, const HullFaces& faces,
                std::vector<std::vector<std::uint32_t>>& of_faces) {
  if (std::ranges::none_of(of_faces, [](const auto& triangles) { return triangles.empty(); })) return;
  const auto beside = neighbors_of(hull.triangles);
  std::vector<std::uint32_t> search_of(hull.triangles.size(), no_index);
  std::vector<std::vector<std::uint32_t>> filled = of_faces;
  for (std::uint32_t start = 0; start < hull.triangles.size(); ++start) {
    const std::uint32_t face = faces.of_triangle[start];
    if (!filled[face].empty()) continue;
    std::vector<std::uint32_t> open{start};
    search_of[start] = start;
    for (std::size_t i = 0; i < open.size() && filled[face].empty(); ++i) {
      const auto& near = of_faces[faces.of_triangle[open[i]]];
      if (!near.empty()) filled[face] = {near.front()};
      for (const std::uint32_t other : beside[open[i]])
        if (std::exchange(search_of[other], start) != start) open.push_back(other);
    }
  }
  of_faces = std::move(filled);
}

ConvexHull solid_hull_of(WeldedMesh& mesh, HullTriangles hull, bool inside_out) {
  HullFaces faces;
  ConvexHull result = simplified_hull(mesh.points_m, hull, faces);
  result.inside_out = inside_out;
  remove_repeated(mesh);
  const TrianglesByEdge edges(hull.triangles);
  std::optional<HullDepth> depths;
  const double larger_m = hull_tolerance_ulp * ulp_m(mesh.points_m);
  std::vector<std::vector<std::uint32_t>> of_faces(result.faces.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    glm::uvec3 triangle = mesh.triangles[t];
    if (inside_out) std::swap(triangle.y, triangle.z);
    std::optional<std::uint32_t> on_hull = edges.find(triangle.x, triangle.y);
    if (on_hull != edges.find(triangle.y, triangle.z)) on_hull.reset();
    if (!on_hull) {
      if (!depths) depths.emplace(hull, mesh.points_m);
      const auto [a, b, c] = mesh.corners(triangle);
      on_hull =
          depths->nearest_with_normal((a + b + c) / 3.0, glm::normalize(glm::cross(b - a, c - a)), larger_m);
    }
    of_faces[faces.of_triangle[*on_hull]].push_back(t);
  }
  fill_faces(hull, faces, of_faces);
  set_face_triangles(result, of_faces, mesh);
  return result;
}

std::optional<ConvexHull> flat_hull_of(WeldedMesh& mesh, const glm::dvec3& normal, double allowed_m) {
  auto flat = flat_hull(mesh.points_m, normal, simplification_ulp * ulp_m(mesh.points_m));
  if (!flat || !covers_polygon(*flat, mesh.points_m, mesh.triangles, allowed_m)) return std::nullopt;
  remove_repeated(mesh);
  std::vector<std::vector<std::uint32_t>> of_faces(2);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.corners(mesh.triangles[t]);
    of_faces[glm::dot(glm::cross(b - a, c - a), normal) > 0.0 ? 0 : 1].push_back(t);
  }
  set_face_triangles(*flat, of_faces, mesh);
  set_box(*flat, mesh.points_m);
  if (flat->corners_m.size() < mesh.points_m.size()) flat->max_omitted_m = max_omitted_m(mesh.points_m, true);
  return flat;
}

/// The normal of the triangle with the largest area.
glm::dvec3 largest_normal(const WeldedMesh& mesh) {
  glm::dvec3 largest(0.0);
  for (const glm::uvec3& t : mesh.triangles) {
    const auto [a, b, c] = mesh.corners(t);
    const glm::dvec3 across = glm::cross(b - a, c - a);
    if (glm::dot(across, across) > glm::dot(largest, largest)) largest = across;
  }
  return glm::normalize(largest);
}

}  // namespace

std::optional<ConvexHull> convex_hull_of_closed(const MeshView& mesh) {
  if (is_plainly_not_convex(mesh)) return std::nullopt;
  WeldedMesh by_place = welded(mesh);
  if (by_place.triangles.empty()) return std::nullopt;
  const double allowed_m = convexity_tolerance_m(by_place.points_m, by_place.diagonal_m);
  auto hull = hull_triangles(by_place.points_m);
  if (!hull) return flat_hull_of(by_place, largest_normal(by_place), allowed_m);
  const double thin_m = hull_tolerance_ulp * ulp_m(by_place.points_m);
  if (const auto thin = thin_direction(*hull, by_place.points_m, thin_m))
    return flat_hull_of(by_place, hull->planes[thin->triangle].normal(), allowed_m);
  const Convexity convexity = convexity_of(by_place, *hull, allowed_m);
  if (convexity == Convexity::none) return std::nullopt;
  return solid_hull_of(by_place, std::move(*hull), convexity == Convexity::fronts_inside);
}

std::optional<ConvexHull> convex_hull_of(const MeshView& mesh) {
  if (mesh.triangles.size() > max_convex_triangles || !is_closed(mesh)) return std::nullopt;
  return convex_hull_of_closed(mesh);
}

}  // namespace rtstdb
