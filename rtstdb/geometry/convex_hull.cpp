#include "rtstdb/geometry/convex_hull.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/geometry/flat_hull.hpp"
#include "rtstdb/geometry/has_area.hpp"
#include "rtstdb/geometry/hull_depth.hpp"
#include "rtstdb/geometry/hull_faces.hpp"
#include "rtstdb/geometry/hull_triangles.hpp"
#include "rtstdb/geometry/mesh_surface.hpp"
#include "rtstdb/geometry/ulp.hpp"
#include "rtstdb/geometry/welded_corners.hpp"

namespace rtstdb {
namespace {

/// Tolerance of each of the two simplifications of a hull, in ulp; corners of a face are within it of the
/// face's plane.
constexpr double simplification_ulp = 0.25 * hull_tolerance_ulp;

/// The distance from the surface of the hull up to which the surface of a mesh is convex.
double tolerance_m(std::span<const glm::vec3> points_m, double diagonal_m) {
  return std::max(convex_tolerance * diagonal_m, hull_tolerance_ulp * ulp_m(points_m));
}

/// The mesh with corners that are compared by place, without positions that no triangle uses.
struct WeldedMesh {
  std::vector<glm::vec3> points_m;
  std::vector<glm::uvec3> triangles;   // indices of points; with an area
  std::vector<std::uint32_t> numbers;  // of these in the mesh
  double diagonal_m = 0.0;

  glm::dvec3 at(std::uint32_t point) const { return glm::dvec3(points_m[point]); }
  std::array<glm::dvec3, 3> corners(const glm::uvec3& t) const { return {at(t.x), at(t.y), at(t.z)}; }
};

WeldedMesh welded(const MeshView& mesh) {
  WeldedMesh made;
  made.diagonal_m = diagonal_m(box_of(mesh));
  const std::vector<std::uint32_t> first = first_at_place(mesh.positions_m);
  std::vector<std::uint32_t> number(mesh.positions_m.size(), no_index);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    glm::uvec3 triangle = mesh.triangles[t];
    for (int i = 0; i < 3; ++i) {
      std::uint32_t& point = number[first[triangle[i]]];
      if (point == no_index) {
        point = static_cast<std::uint32_t>(made.points_m.size());
        made.points_m.push_back(mesh.positions_m[triangle[i]]);
      }
      triangle[i] = point;
    }
    if (!has_area(made.points_m[triangle.x], made.points_m[triangle.y], made.points_m[triangle.z])) continue;
    made.triangles.push_back(triangle);
    made.numbers.push_back(t);
  }
  return made;
}

/// Leaves the first of triangles with the same corners in the same order.
void remove_repeated(WeldedMesh& mesh) {
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> order;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> corners{mesh.triangles[t].x, mesh.triangles[t].y, mesh.triangles[t].z};
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    order.emplace_back(corners, t);
  }
  std::ranges::sort(order);
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < order.size(); ++i)
    if (i == 0 || order[i].first != order[i - 1].first) kept.push_back(order[i].second);
  if (kept.size() == order.size()) return;
  std::ranges::sort(kept);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    mesh.triangles[i] = mesh.triangles[kept[i]];
    mesh.numbers[i] = mesh.numbers[kept[i]];
  }
  mesh.triangles.resize(kept.size());
  mesh.numbers.resize(kept.size());
}

/// Finds out that most meshes are not convex, before anything is sorted: a corner is deep inside the hull of
/// a few corners.
bool is_plainly_not_convex(const MeshView& mesh) {
  constexpr std::size_t max_samples = 4096, max_tested = 1024;
  glm::dvec3 minimum(std::numeric_limits<double>::infinity());
  glm::dvec3 maximum = -minimum;
  for (const glm::vec3& p : mesh.positions_m) {
    minimum = glm::min(minimum, glm::dvec3(p));
    maximum = glm::max(maximum, glm::dvec3(p));
  }
  const std::size_t count = std::min(max_samples, mesh.triangles.size());
  std::vector<glm::vec3> samples_m;
  for (std::size_t i = 0; i < count; ++i)
    samples_m.push_back(mesh.positions_m[mesh.triangles[i * mesh.triangles.size() / count].x]);
  std::vector<glm::vec3> extremes_m;
  for (int i = 0; i < 27; ++i) {
    const glm::vec3 direction(glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1);
    extremes_m.push_back(
        *std::ranges::max_element(samples_m, {}, [&](const glm::vec3& p) { return glm::dot(direction, p); }));
  }
  const auto hull = hull_triangles(extremes_m);
  if (!hull) return false;
  const double allowed_m = tolerance_m(mesh.positions_m, glm::length(maximum - minimum));
  const std::size_t tested = std::min(max_tested, count);
  for (std::size_t i = 0; i < tested; ++i) {
    const glm::dvec3 p_m(samples_m[i * count / tested]);
    if (std::ranges::all_of(hull->planes,
                            [&](const OrientedPlane& plane) { return plane.height_m(p_m) < -allowed_m; }))
      return true;
  }
  return false;
}

/// Triangles of a hull by their edges.
class EdgeTable {
 public:
  explicit EdgeTable(std::span<const glm::uvec3> triangles) {
    edges_.reserve(3 * triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      for (int i = 0; i < 3; ++i)
        edges_.emplace_back(key(triangles[t][i], triangles[t][(i + 1) % 3]), t);
    std::ranges::sort(edges_);
  }

  /// The triangle with the edge in this direction.
  std::optional<std::uint32_t> find(std::uint32_t from, std::uint32_t to) const {
    const auto found = std::ranges::lower_bound(edges_, std::pair(key(from, to), 0u));
    if (found == edges_.end() || found->first != key(from, to)) return std::nullopt;
    return found->second;
  }

 private:
  static std::uint64_t key(std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; }
  std::vector<std::pair<std::uint64_t, std::uint32_t>> edges_;
};

/// Where the surface of a mesh is in the hull of its corners.
class SurfaceCheck {
 public:
  SurfaceCheck(const WeldedMesh& mesh, const HullTriangles& hull, double allowed_m)
      : mesh_(mesh), hull_(hull), allowed_m_(allowed_m), edges_(hull.triangles) {}

  /// Whether every point of the surface is near that of the hull. It tells also how far the volume of the
  /// mesh may be from a multiple of the hull's.
  bool is_near_hull() {
    for (const glm::uvec3& triangle : mesh_.triangles) {
      const auto depth_m = depth_of(triangle);
      if (!depth_m) return false;
      const OrientedPlane plane(mesh_.points_m[triangle.x], mesh_.points_m[triangle.y],
                                mesh_.points_m[triangle.z]);
      unknown_m3_ += 2.0 * *depth_m * plane.area_m2();
    }
    return true;
  }

  double unknown_m3() const noexcept { return unknown_m3_; }

 private:
  /// How deep the triangle's deepest point lies, at most; empty: too deep.
  std::optional<double> depth_of(const glm::uvec3& triangle) {
    double min_m = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      for (const auto& beside : {edges_.find(a, b), edges_.find(b, a)}) {
        if (!beside) continue;
        double deepest_m = 0.0;
        for (int k = 0; k < 3; ++k)
          deepest_m = std::max(deepest_m, -hull_.planes[*beside].height_m(mesh_.at(triangle[k])));
        min_m = std::min(min_m, deepest_m);
      }
    }
    if (min_m <= allowed_m_) return min_m;
    if (!depths_) depths_.emplace(hull_, mesh_.points_m);
    return depths_->depth_within(mesh_.corners(triangle), allowed_m_);
  }

  const WeldedMesh& mesh_;
  const HullTriangles& hull_;
  double allowed_m_;
  EdgeTable edges_;
  std::optional<HullDepth> depths_;
  double unknown_m3_ = 0.0;
};

/// A signed volume with a bound of its rounding error.
struct Volume {
  double value_m3 = 0.0, rounding_m3 = 0.0;
};

Volume volume_of(std::span<const glm::vec3> points_m, std::span<const glm::uvec3> triangles) {
  constexpr double unit = 1e-13;  // more than that of a sum of max_convex_triangles terms
  const glm::dvec3 origin(points_m[triangles[0].x]);
  Volume volume;
  for (const glm::uvec3& t : triangles) {
    const glm::dvec3 a = glm::dvec3(points_m[t.x]) - origin;
    const glm::dvec3 b = glm::dvec3(points_m[t.y]) - origin;
    const double part_m3 = glm::dot(a, glm::cross(b, glm::dvec3(points_m[t.z]) - origin)) / 6.0;
    volume.value_m3 += part_m3;
    volume.rounding_m3 += unit * std::abs(part_m3);
  }
  return volume;
}

// ---- faces

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

/// Whether the hull of some points is within the tolerance of a point: a segment or a triangle of them is.
/// Sets `near` to the points of that.
bool is_near_some(std::span<const glm::vec3> points_m, const std::vector<std::uint32_t>& around,
                  std::uint32_t point, double tolerance_m, std::array<std::uint32_t, 3>& near) {
  const auto at = [&](std::uint32_t i) { return glm::dvec3(points_m[i]); };
  for (std::size_t i = 0; i < around.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      for (std::size_t j = 0; j <= k; ++j) {
        near = {around[i], around[k], around[j]};
        if (distance_to_triangle_m({at(near[0]), at(near[1]), at(near[2])}, at(point)) <= tolerance_m)
          return true;
      }
    }
  }
  return false;
}

/// The corners without those that are near the hull of the corners around them: of points that are equally
/// far outside a plane, as those of an edge, quickhull chooses any first.
std::vector<std::uint32_t> needed_corners(std::span<const glm::vec3> points_m, const HullTriangles& hull,
                                          double tolerance_m) {
  constexpr std::size_t max_around = 16;  // the number of triangles of corners grows with its cube
  std::vector<std::vector<std::uint32_t>> around(points_m.size());
  for (const glm::uvec3& t : hull.triangles)
    for (int i = 0; i < 3; ++i)
      around[t[i]].push_back(t[(i + 1) % 3]);
  // Corners that others are near stay, so that distances do not add up.
  std::vector<char> stays(points_m.size()), is_left_out(points_m.size());
  std::vector<std::uint32_t> needed;
  for (const std::uint32_t corner : hull.corners) {
    std::vector<std::uint32_t> present;
    for (const std::uint32_t other : around[corner])
      if (is_left_out[other] == 0) present.push_back(other);
    std::array<std::uint32_t, 3> near{};
    if (stays[corner] == 0 && present.size() <= max_around &&
        is_near_some(points_m, present, corner, tolerance_m, near)) {
      is_left_out[corner] = 1;
      for (const std::uint32_t other : near)
        stays[other] = 1;
    } else {
      needed.push_back(corner);
    }
  }
  return needed;
}

/// Replaces a hull by that of some of its corners, up to the tolerance.
void reduce_to(HullTriangles& hull, std::span<const glm::vec3> points_m,
               const std::vector<std::uint32_t>& corners, double tolerance_m) {
  std::vector<glm::vec3> corners_m;
  for (const std::uint32_t corner : corners)
    corners_m.push_back(points_m[corner]);
  auto reduced = hull_triangles(corners_m, tolerance_m);
  if (!reduced) return;
  for (std::uint32_t& corner : reduced->corners)
    corner = corners[corner];
  for (glm::uvec3& t : reduced->triangles)
    t = {corners[t.x], corners[t.y], corners[t.z]};
  hull = std::move(*reduced);
}

/// Upper bound of the distance of omitted corners from the hull of the others. Those of a flat hull may also
/// be off its plane.
float max_omitted_m(std::span<const glm::vec3> points_m, bool is_flat) {
  const double flatness_ulp = is_flat ? hull_tolerance_ulp : 0.0;
  return static_cast<float>((2.001 * simplification_ulp + flatness_ulp) * ulp_m(points_m));
}

/// The hull with its faces, from the exact hull of the mesh's corners.
ConvexHull simplified(std::span<const glm::vec3> points_m, HullTriangles& hull, HullFaces& faces) {
  const double deviation_m = simplification_ulp * ulp_m(points_m);
  const std::size_t exact_corners = hull.corners.size();
  reduce_to(hull, points_m, std::vector(hull.corners), deviation_m);
  const std::vector<std::uint32_t> needed = needed_corners(points_m, hull, deviation_m);
  if (needed.size() < hull.corners.size()) reduce_to(hull, points_m, needed, 0.0);
  faces = hull_faces(hull, points_m, deviation_m);
  ConvexHull made = std::move(faces.hull);
  set_box(made, points_m);
  if (hull.corners.size() < exact_corners) made.max_omitted_m = max_omitted_m(points_m, false);
  return made;
}

ConvexHull solid_hull_of(WeldedMesh& mesh, HullTriangles hull, bool inside_out) {
  HullFaces faces;
  ConvexHull made = simplified(mesh.points_m, hull, faces);
  made.inside_out = inside_out;
  remove_repeated(mesh);
  const EdgeTable edges(hull.triangles);
  std::optional<HullDepth> depths;
  const double larger_m = hull_tolerance_ulp * ulp_m(mesh.points_m);
  std::vector<std::vector<std::uint32_t>> of_faces(made.faces.size());
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
  set_face_triangles(made, of_faces, mesh);
  return made;
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

/// Whether the mesh, whose surface is near that of its hull, covers it. Its volume is near a multiple of the
/// hull's then, and the multiple is zero if both sides of walls are its surface. The volume of a thin body
/// may be less than its uncertainty: such a body has to cover the hull as seen along the least extent.
bool covers_hull(const WeldedMesh& mesh, const HullTriangles& hull, const Volume& volume, double unknown_m3,
                 double allowed_m) {
  if (std::abs(volume.value_m3) > unknown_m3 + volume.rounding_m3) return true;
  if (volume_of(mesh.points_m, hull.triangles).value_m3 > 2.0 * (unknown_m3 + volume.rounding_m3))
    return false;
  const auto thin = thin_direction(hull, mesh.points_m, 16.0 * allowed_m);
  if (!thin) return false;
  const auto flat = flat_hull(mesh.points_m, hull.planes[thin->triangle].normal(), allowed_m);
  return flat && covers_polygon(*flat, mesh.points_m, mesh.triangles, allowed_m);
}

/// The mesh is closed.
std::optional<ConvexHull> hull_of_closed(const MeshView& mesh) {
  if (is_plainly_not_convex(mesh)) return std::nullopt;
  WeldedMesh made = welded(mesh);
  if (made.triangles.empty()) return std::nullopt;
  const double allowed_m = tolerance_m(made.points_m, made.diagonal_m);
  auto hull = hull_triangles(made.points_m);
  if (!hull) return flat_hull_of(made, largest_normal(made), allowed_m);
  if (const auto thin = thin_direction(*hull, made.points_m, hull_tolerance_ulp * ulp_m(made.points_m)))
    return flat_hull_of(made, hull->planes[thin->triangle].normal(), allowed_m);
  SurfaceCheck check(made, *hull, allowed_m);
  if (!check.is_near_hull()) return std::nullopt;
  const Volume volume = volume_of(made.points_m, made.triangles);
  if (!covers_hull(made, *hull, volume, check.unknown_m3(), allowed_m)) return std::nullopt;
  return solid_hull_of(made, std::move(*hull), volume.value_m3 < 0.0);
}

}  // namespace

std::optional<ConvexHull> convex_hull_of(const MeshView& mesh) {
  if (mesh.triangles.size() > max_convex_triangles || !is_closed(mesh)) return std::nullopt;
  return hull_of_closed(mesh);
}

std::optional<ConvexHull> convex_hull_of_points(std::span<const glm::vec3> points_m) {
  auto hull = hull_triangles(points_m);
  if (!hull) return std::nullopt;
  std::optional<ConvexHull> made;
  const double ulp = ulp_m(points_m);
  if (const auto thin = thin_direction(*hull, points_m, hull_tolerance_ulp * ulp)) {
    made = flat_hull(points_m, hull->planes[thin->triangle].normal(), simplification_ulp * ulp);
    if (made) {
      set_box(*made, points_m);
      made->max_omitted_m = max_omitted_m(points_m, true);
    }
  } else {
    HullFaces faces;
    made = simplified(points_m, *hull, faces);
  }
  return made;
}

namespace {

/// For each triangle the number of its piece, in the order of their first triangles.
struct Pieces {
  std::vector<std::uint32_t> of_triangles;
  std::uint32_t count = 0;
};

Pieces numbered_pieces(const MeshView& mesh) {
  std::vector<std::uint32_t> parent(mesh.positions_m.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root_of = [&](std::uint32_t corner) {
    while (parent[corner] != corner) {
      parent[corner] = parent[parent[corner]];
      corner = parent[corner];
    }
    return corner;
  };
  for (const glm::uvec3& triangle : mesh.triangles) {
    const std::uint32_t root = root_of(triangle.x);
    parent[root_of(triangle.y)] = root;
    parent[root_of(triangle.z)] = root_of(root);
  }
  Pieces pieces;
  std::vector<std::uint32_t> number(parent.size(), no_index);
  for (const glm::uvec3& triangle : mesh.triangles) {
    std::uint32_t& piece = number[root_of(triangle.x)];
    if (piece == no_index) piece = pieces.count++;
    pieces.of_triangles.push_back(piece);
  }
  return pieces;
}

}  // namespace

ConvexParts convex_parts_of(const MeshView& mesh) {
  // If all pieces are closed, the whole mesh is.
  if (mesh.triangles.size() > max_convex_triangles || !is_closed(mesh)) return {};
  if (auto whole = hull_of_closed(mesh)) return {std::move(*whole)};
  const Pieces pieces = numbered_pieces(mesh);
  if (pieces.count < 2 || pieces.count > max_convex_parts) return {};
  std::vector<TriangleMesh> meshes(pieces.count);
  std::vector<std::vector<std::uint32_t>> numbers(pieces.count);  // of the triangles in the whole mesh
  std::vector<std::uint32_t> local(mesh.positions_m.size(), no_index);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    TriangleMesh& piece = meshes[pieces.of_triangles[t]];
    glm::uvec3& triangle = piece.triangles.emplace_back(mesh.triangles[t]);
    for (int i = 0; i < 3; ++i) {
      std::uint32_t& corner = local[triangle[i]];
      if (corner == no_index) {
        corner = static_cast<std::uint32_t>(piece.positions_m.size());
        piece.positions_m.push_back(mesh.positions_m[triangle[i]]);
      }
      triangle[i] = corner;
    }
    numbers[pieces.of_triangles[t]].push_back(t);
  }
  ConvexParts parts;
  for (std::uint32_t piece = 0; piece < pieces.count; ++piece) {
    auto hull = convex_hull_of(meshes[piece]);
    if (!hull || hull->inside_out != (parts.empty() ? hull->inside_out : parts.front().inside_out)) return {};
    for (std::uint32_t& triangle : hull->face_triangles)
      triangle = numbers[piece][triangle];
    parts.push_back(std::move(*hull));
  }
  return parts;
}

ConvexPartPoints pieces_of(const TriangleMesh& mesh) {
  const Pieces pieces = numbered_pieces(mesh);
  ConvexPartPoints corners_m(pieces.count);
  std::vector<char> is_taken(mesh.positions_m.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t corner = mesh.triangles[t][i];
      if (std::exchange(is_taken[corner], 1) == 0)
        corners_m[pieces.of_triangles[t]].push_back(mesh.positions_m[corner]);
    }
  }
  return corners_m;
}

}  // namespace rtstdb
