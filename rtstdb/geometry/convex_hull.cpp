#include "rtstdb/geometry/convex_hull.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/geometry/welded_corners.hpp"

namespace rtstdb {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Of a triangle; `is_known`: its corners determine it in single precision.
struct Plane {
  glm::dvec3 normal{0.0};  // unit
  double offset_m = 0.0;
  double area_m2 = 0.0;
  bool is_known = false;
};

/// A binary tree of boxes over points: finds out whether one of them is in front of a plane.
class PointTree {
 public:
  explicit PointTree(std::vector<glm::dvec3> points_m) : points_m_(std::move(points_m)) {
    nodes_.reserve(points_m_.size());
    build(0, static_cast<std::uint32_t>(points_m_.size()));
  }

  bool has_point_in_front_of(const Plane& plane, double tolerance_m) const {
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const std::uint32_t index = stack.back();
      const Node& node = nodes_[index];
      stack.pop_back();
      const double reach_m =
          glm::dot(plane.normal, node.center) + glm::dot(glm::abs(plane.normal), node.half_extent);
      if (reach_m - plane.offset_m <= tolerance_m) continue;
      if (node.right != none) {
        stack.insert(stack.end(), {node.right, index + 1});
        continue;
      }
      for (std::uint32_t i = node.first; i < node.end; ++i)
        if (glm::dot(plane.normal, points_m_[i]) - plane.offset_m > tolerance_m) return true;
    }
    return false;
  }

 private:
  static constexpr std::uint32_t points_per_leaf = 8;

  struct Node {
    glm::dvec3 center{0.0}, half_extent{0.0};
    std::uint32_t first = 0, end = 0;
    std::uint32_t right = none;  // of an inner node, whose left child follows it
  };

  void build(std::uint32_t first, std::uint32_t end) {
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    glm::dvec3 minimum(std::numeric_limits<double>::infinity());
    glm::dvec3 maximum = -minimum;
    for (std::uint32_t i = first; i < end; ++i) {
      minimum = glm::min(minimum, points_m_[i]);
      maximum = glm::max(maximum, points_m_[i]);
    }
    nodes_.push_back({.center = 0.5 * (minimum + maximum),
                      .half_extent = 0.5 * (maximum - minimum),
                      .first = first,
                      .end = end});
    if (end - first <= points_per_leaf) return;
    const glm::dvec3 extent = maximum - minimum;
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const std::uint32_t middle = (first + end) / 2;
    std::nth_element(points_m_.begin() + first, points_m_.begin() + middle, points_m_.begin() + end,
                     [&](const glm::dvec3& a, const glm::dvec3& b) { return a[axis] < b[axis]; });
    build(first, middle);
    nodes_[index].right = static_cast<std::uint32_t>(nodes_.size());
    build(middle, end);
  }

  std::vector<glm::dvec3> points_m_;
  std::vector<Node> nodes_;
};

/// The mesh with corners that are compared by place, its planes, and the orientation that turns fronts
/// outward.
struct WeldedMesh {
  std::span<const glm::vec3> positions_m;
  std::vector<glm::uvec3> triangles;   // corners by place; without those that occur again
  std::vector<std::uint32_t> numbers;  // of these in the mesh
  std::vector<Plane> planes;           // outward
  Bounds bounds;
  double diagonal_m = 0.0;
  bool inside_out = false;  // the mesh's fronts; those of `triangles` are outside

  glm::dvec3 at(std::uint32_t corner) const { return glm::dvec3(positions_m[corner]); }
};

Plane plane_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double diagonal_m) {
  const glm::dvec3 cross = glm::cross(b - a, c - a);
  const double twice_area = glm::length(cross);
  if (!(twice_area > 0.0)) return {};
  const double longest =
      std::sqrt(std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)}));
  const double rounding_m = std::max({glm::length(a), glm::length(b), glm::length(c)}) * 0x1p-23;
  // The plane turns about the longest edge by the rounding of the corner opposite to it.
  const double lift_m = rounding_m * longest / twice_area * diagonal_m;
  const glm::dvec3 normal = cross / twice_area;
  return {.normal = normal,
          .offset_m = glm::dot(normal, a + b + c) / 3.0,
          .area_m2 = 0.5 * twice_area,
          .is_known = lift_m < convex_tolerance * diagonal_m};
}

/// Leaves the first of triangles with the same corners in the same order. `numbers`: of those that stay.
void remove_repeated(std::vector<glm::uvec3>& triangles, std::vector<std::uint32_t>& numbers) {
  std::set<std::array<std::uint32_t, 3>> known;
  std::vector<glm::uvec3> kept;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    std::array<std::uint32_t, 3> corners{triangles[t].x, triangles[t].y, triangles[t].z};
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    if (!known.insert(corners).second) continue;
    kept.push_back(triangles[t]);
    numbers.push_back(t);
  }
  triangles = std::move(kept);
}

WeldedMesh welded(const MeshView& mesh) {
  WeldedMesh made{.positions_m = mesh.positions_m,
                  .triangles = {mesh.triangles.begin(), mesh.triangles.end()},
                  .numbers = {},
                  .planes = {},
                  .bounds = {},
                  .diagonal_m = 0.0};
  const std::vector<std::uint32_t> first = first_at_place(mesh.positions_m);
  glm::vec3 minimum(std::numeric_limits<float>::infinity());
  glm::vec3 maximum = -minimum;
  for (glm::uvec3& triangle : made.triangles) {
    for (int i = 0; i < 3; ++i) {
      triangle[i] = first[triangle[i]];
      minimum = glm::min(minimum, mesh.positions_m[triangle[i]]);
      maximum = glm::max(maximum, mesh.positions_m[triangle[i]]);
    }
  }
  made.bounds = {minimum, maximum};
  made.diagonal_m = glm::length(glm::dvec3(maximum) - glm::dvec3(minimum));
  const glm::dvec3 center = 0.5 * (glm::dvec3(minimum) + glm::dvec3(maximum));
  double volume = 0.0;
  remove_repeated(made.triangles, made.numbers);
  for (const glm::uvec3& triangle : made.triangles) {
    made.planes.push_back(
        plane_of(made.at(triangle.x), made.at(triangle.y), made.at(triangle.z), made.diagonal_m));
    const Plane& plane = made.planes.back();
    volume += plane.area_m2 * (plane.offset_m - glm::dot(plane.normal, center));
  }
  made.inside_out = volume < 0.0;
  if (made.inside_out) {
    for (Plane& plane : made.planes) {
      plane.normal = -plane.normal;
      plane.offset_m = -plane.offset_m;
    }
    for (glm::uvec3& triangle : made.triangles)
      std::swap(triangle.y, triangle.z);
  }
  return made;
}

/// Finds out with a few triangles that most meshes are not convex, before anything is sorted: corners are on
/// both sides of a plane.
bool is_plainly_not_convex(const MeshView& mesh) {
  constexpr std::size_t samples = 16;
  glm::dvec3 minimum(std::numeric_limits<double>::infinity());
  glm::dvec3 maximum = -minimum;
  for (const glm::vec3& p : mesh.positions_m) {
    minimum = glm::min(minimum, glm::dvec3(p));
    maximum = glm::max(maximum, glm::dvec3(p));
  }
  const double diagonal_m = glm::length(maximum - minimum);
  for (std::size_t sample = 0; sample < samples; ++sample) {
    const glm::uvec3& of_sample = mesh.triangles[sample * mesh.triangles.size() / samples];
    const Plane plane =
        plane_of(glm::dvec3(mesh.positions_m[of_sample.x]), glm::dvec3(mesh.positions_m[of_sample.y]),
                 glm::dvec3(mesh.positions_m[of_sample.z]), diagonal_m);
    if (!plane.is_known) continue;
    double above_m = 0.0, below_m = 0.0;
    for (const glm::uvec3& triangle : mesh.triangles) {
      const double height_m =
          glm::dot(plane.normal, glm::dvec3(mesh.positions_m[triangle.x])) - plane.offset_m;
      above_m = std::max(above_m, height_m);
      below_m = std::max(below_m, -height_m);
    }
    if (std::min(above_m, below_m) > convex_tolerance * diagonal_m) return true;
  }
  return false;
}

bool is_convex(const WeldedMesh& mesh) {
  std::vector<std::uint32_t> used;
  for (const glm::uvec3& triangle : mesh.triangles)
    used.insert(used.end(), {triangle.x, triangle.y, triangle.z});
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<glm::dvec3> points_m;
  points_m.reserve(used.size());
  for (const std::uint32_t corner : used)
    points_m.push_back(mesh.at(corner));
  const PointTree tree(std::move(points_m));
  const double tolerance_m = convex_tolerance * mesh.diagonal_m;
  return std::ranges::none_of(mesh.planes, [&](const Plane& plane) {
    return plane.is_known && tree.has_point_in_front_of(plane, tolerance_m);
  });
}

// ---- faces

using DirectedEdge = std::pair<std::uint32_t, std::uint32_t>;  // from, to

/// The triangles of each directed edge: several where sheets touch, as on both sides of a flat body.
std::multimap<DirectedEdge, std::uint32_t> triangles_by_edge(const WeldedMesh& mesh) {
  std::multimap<DirectedEdge, std::uint32_t> by_edge;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i)
      by_edge.emplace(DirectedEdge{mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]}, t);
  }
  return by_edge;
}

class FaceMaker {
 public:
  explicit FaceMaker(const WeldedMesh& mesh)
      : mesh_(mesh), by_edge_(triangles_by_edge(mesh)), face_of_(mesh.triangles.size(), none) {}

  /// Faces of triangles that are reachable from the largest one, then from the largest of the rest.
  void make_faces() {
    std::vector<std::uint32_t> by_area(mesh_.triangles.size());
    std::iota(by_area.begin(), by_area.end(), 0u);
    std::ranges::stable_sort(by_area, [&](std::uint32_t a, std::uint32_t b) {
      return mesh_.planes[a].area_m2 > mesh_.planes[b].area_m2;
    });
    for (const std::uint32_t seed : by_area) {
      if (face_of_[seed] == none && mesh_.planes[seed].area_m2 > 0.0) add_face(seed);
    }
  }

  /// The hull without corners of fewer than three faces, unless all of it has only two.
  ConvexHull hull() const {
    std::vector<std::vector<std::uint32_t>> faces_of(mesh_.positions_m.size());
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      for (const std::uint32_t corner : faces_[f].loop)
        faces_of[corner].push_back(f);
    }
    const std::size_t needed = faces_.size() > 2 ? 3 : 2;
    ConvexHull made;
    std::vector<std::uint32_t> number(mesh_.positions_m.size(), none);
    for (std::uint32_t corner = 0; corner < faces_of.size(); ++corner) {
      if (faces_of[corner].size() < needed) continue;
      number[corner] = static_cast<std::uint32_t>(made.corners_m.size());
      made.corners_m.push_back(mesh_.positions_m[corner]);
    }
    for (const Polygon& polygon : faces_) {
      ConvexHull::Face face{.normal = glm::vec3(polygon.normal),
                            .first_corner = static_cast<std::uint32_t>(made.face_corners.size()),
                            .first_triangle = static_cast<std::uint32_t>(made.face_triangles.size()),
                            .triangle_count = static_cast<std::uint32_t>(polygon.triangles.size())};
      for (const std::uint32_t corner : polygon.loop)
        if (number[corner] != none) made.face_corners.push_back(number[corner]);
      face.corner_count = static_cast<std::uint32_t>(made.face_corners.size()) - face.first_corner;
      for (const std::uint32_t t : polygon.triangles)
        made.face_triangles.push_back(mesh_.numbers[t]);
      if (face.corner_count > 2) made.faces.push_back(face);
    }
    const glm::dvec3 minimum(mesh_.bounds.minimum_m);
    const glm::dvec3 maximum(mesh_.bounds.maximum_m);
    made.center_m = glm::vec3(0.5 * (minimum + maximum));
    made.half_extent_m = glm::vec3(0.5 * (maximum - minimum));
    made.inside_out = mesh_.inside_out;
    return made;
  }

 private:
  struct Polygon {
    glm::dvec3 normal{0.0};
    std::vector<std::uint32_t> loop;
    std::vector<std::uint32_t> triangles;
  };

  bool lies_in(const Plane& plane, std::uint32_t triangle) const {
    const Plane& other = mesh_.planes[triangle];
    if (glm::dot(plane.normal, other.normal) < 0.99 && other.is_known) return false;
    const double tolerance_m = convex_tolerance * mesh_.diagonal_m;
    for (int i = 0; i < 3; ++i) {
      const double height_m = glm::dot(plane.normal, mesh_.at(mesh_.triangles[triangle][i])) - plane.offset_m;
      if (std::abs(height_m) > tolerance_m) return false;
    }
    return true;
  }

  void add_face(std::uint32_t seed) {
    const auto face = static_cast<std::uint32_t>(faces_.size());
    Polygon polygon;
    std::vector<std::uint32_t> open{seed};
    face_of_[seed] = face;
    glm::dvec3 area(0.0);
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      open.pop_back();
      polygon.triangles.push_back(t);
      area += mesh_.planes[t].area_m2 * mesh_.planes[t].normal;
      for (int i = 0; i < 3; ++i) {
        const auto [first, end] =
            by_edge_.equal_range({mesh_.triangles[t][(i + 1) % 3], mesh_.triangles[t][i]});
        const auto beside = std::find_if(first, end, [&](const auto& of_edge) {
          return face_of_[of_edge.second] == none && lies_in(mesh_.planes[seed], of_edge.second);
        });
        if (beside == end) continue;
        face_of_[beside->second] = face;
        open.push_back(beside->second);
      }
    }
    std::ranges::sort(polygon.triangles);
    polygon.normal = glm::normalize(area);
    if (!trace_loop(polygon)) {
      // Not a disc, which only meshes with triangles that overlap have: each triangle is a face of its own.
      for (const std::uint32_t t : polygon.triangles) {
        const glm::uvec3& corners = mesh_.triangles[t];
        if (mesh_.planes[t].area_m2 > 0.0)
          faces_.push_back({mesh_.planes[t].normal, {corners.x, corners.y, corners.z}, {t}});
      }
      return;
    }
    faces_.push_back(std::move(polygon));
  }

  /// The border of the polygon's triangles. False: it is not one loop.
  bool trace_loop(Polygon& polygon) const {
    std::map<DirectedEdge, int> count;
    for (const std::uint32_t t : polygon.triangles) {
      for (int i = 0; i < 3; ++i) {
        const DirectedEdge edge{mesh_.triangles[t][i], mesh_.triangles[t][(i + 1) % 3]};
        const DirectedEdge back{edge.second, edge.first};
        if (edge.first == edge.second) continue;
        if (const auto twin = count.find(back); twin != count.end() && twin->second > 0)
          --twin->second;
        else
          ++count[edge];
      }
    }
    std::map<std::uint32_t, std::uint32_t> next;
    for (const auto& [edge, times] : count) {
      if (times == 0) continue;
      if (times > 1 || !next.emplace(edge.first, edge.second).second) return false;
    }
    if (next.size() < 3) return false;
    const std::uint32_t start = next.begin()->first;
    std::uint32_t corner = start;
    do {
      polygon.loop.push_back(corner);
      const auto following = next.find(corner);
      if (following == next.end()) return false;
      corner = following->second;
    } while (corner != start && polygon.loop.size() <= next.size());
    return polygon.loop.size() == next.size();
  }

  const WeldedMesh& mesh_;
  const std::multimap<DirectedEdge, std::uint32_t> by_edge_;
  std::vector<std::uint32_t> face_of_;  // of each triangle
  std::vector<Polygon> faces_;
};

}  // namespace

std::optional<ConvexHull> convex_hull_of(const MeshView& mesh) {
  if (mesh.triangles.size() > max_convex_triangles || !is_closed(mesh) || is_plainly_not_convex(mesh))
    return std::nullopt;
  const WeldedMesh made = welded(mesh);
  if (!is_convex(made)) return std::nullopt;
  FaceMaker maker(made);
  maker.make_faces();
  ConvexHull hull = maker.hull();
  if (hull.faces.empty()) return std::nullopt;
  return hull;
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
  std::vector<std::uint32_t> number(parent.size(), none);
  for (const glm::uvec3& triangle : mesh.triangles) {
    std::uint32_t& piece = number[root_of(triangle.x)];
    if (piece == none) piece = pieces.count++;
    pieces.of_triangles.push_back(piece);
  }
  return pieces;
}

}  // namespace

ConvexParts convex_parts_of(const MeshView& mesh) {
  if (mesh.triangles.size() > max_convex_triangles) return {};
  if (auto whole = convex_hull_of(mesh)) return {std::move(*whole)};
  const Pieces pieces = numbered_pieces(mesh);
  if (pieces.count < 2 || pieces.count > max_convex_parts) return {};
  std::vector<TriangleMesh> meshes(pieces.count);
  std::vector<std::vector<std::uint32_t>> numbers(pieces.count);  // of the triangles in the whole mesh
  std::vector<std::uint32_t> local(mesh.positions_m.size(), none);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    TriangleMesh& piece = meshes[pieces.of_triangles[t]];
    glm::uvec3& triangle = piece.triangles.emplace_back(mesh.triangles[t]);
    for (int i = 0; i < 3; ++i) {
      std::uint32_t& corner = local[triangle[i]];
      if (corner == none) {
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
