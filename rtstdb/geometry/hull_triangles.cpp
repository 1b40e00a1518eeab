#include "rtstdb/geometry/hull_triangles.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

#include "rtstdb/geometry/mesh_surface.hpp"

namespace rtstdb {
namespace {

/// Quickhull (Barber, Dobkin, Huhdanpaa, "The Quickhull Algorithm for Convex Hulls", 1996). Each point
/// outside the hull belongs to a facet that it is in front of. The farthest point of a facet becomes a
/// corner: the facets that it is in front of are replaced by new ones, from their border to the point. All
/// signs are exact, and a point in the plane of a facet is not in front of it, so the facets that a point is
/// in front of are connected, their border is one loop, and no facet is without an area. A point that is in
/// front of none of the new facets is inside the new hull: if it is in front of another facet, and of the one
/// it belonged to, it is in front of two facets beside each other of which one is replaced, hence of the new
/// one there.
class Quickhull {
 public:
  Quickhull(std::span<const glm::vec3> points_m, double tolerance_m)
      : points_m_(points_m),
        tolerance_m_(tolerance_m),
        next_(points_m.size(), no_index),
        facet_from_(points_m.size()) {}

  /// False: all points lie in one plane.
  bool make() {
    const auto first = first_corners();
    if (!first) return false;
    add_tetrahedron(*first);
    for (std::uint32_t i = 0; i < facets_.size(); ++i)
      pending_.push_back(i);
    // In order of age: else one side would be complete while the others are few large facets, and each later
    // point there would be in front of many facets.
    for (; !pending_.empty(); pending_.pop_front()) {
      const std::uint32_t facet = pending_.front();
      if (!has_points(facet)) continue;
      extend_from(facet);
      if (has_points(facet)) pending_.push_back(facet);
    }
    return true;
  }

  struct Facet {
    std::array<std::uint32_t, 3> corners{};
    std::array<std::uint32_t, 3> beside{};  // across the edge from corner i to corner i + 1
    OrientedPlane plane;
    std::uint32_t first_outside = no_index;  // a list of points in front of it
    std::uint32_t farthest = no_index;       // of these
    double farthest_m = -std::numeric_limits<double>::infinity();
    bool is_alive = true;
    std::uint32_t mark = 0;  // the search that has visited it
  };

  const std::vector<Facet>& facets() const noexcept { return facets_; }

 private:
  struct Edge {
    std::uint32_t from, to;
    std::uint32_t hidden, edge_of_hidden;  // the facet on the other side, and its edge
  };

  glm::dvec3 at(std::uint32_t point) const { return glm::dvec3(points_m_[point]); }
  bool has_points(std::uint32_t facet) const {
    return facets_[facet].is_alive && facets_[facet].farthest != no_index;
  }

  template <class Measure>
  std::uint32_t farthest_by(Measure&& measure) const {
    std::uint32_t best = 0;
    double max_value = -std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < points_m_.size(); ++i) {
      const double value = measure(i);
      if (value > max_value) best = i, max_value = value;
    }
    return best;
  }

  /// Four points that are not in a plane.
  std::optional<std::array<std::uint32_t, 4>> first_corners() const {
    if (points_m_.size() < 4) return std::nullopt;
    const std::uint32_t a = farthest_by([&](std::uint32_t i) { return -at(i).x; });
    const std::uint32_t b = farthest_by([&](std::uint32_t i) {
      const glm::dvec3 off = at(i) - at(a);
      return glm::dot(off, off);
    });
    const std::uint32_t c = farthest_by([&](std::uint32_t i) {
      const glm::dvec3 across = glm::cross(at(i) - at(a), at(b) - at(a));
      return glm::dot(across, across);
    });
    const OrientedPlane plane(points_m_[a], points_m_[b], points_m_[c]);
    if (plane.area_m2() == 0.0) return std::nullopt;
    std::uint32_t d = farthest_by([&](std::uint32_t i) { return std::abs(plane.height_m(at(i))); });
    // Rounding may hide the points that are not in the plane.
    for (std::uint32_t i = 0; i < points_m_.size() && plane.side_of(points_m_[d]) == 0; ++i)
      d = i;
    const int side = plane.side_of(points_m_[d]);
    if (side == 0) return std::nullopt;
    return side < 0 ? std::array{a, b, c, d} : std::array{a, c, b, d};
  }

  std::uint32_t add_facet(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    std::uint32_t index = static_cast<std::uint32_t>(facets_.size());
    if (unused_.empty()) {
      facets_.emplace_back();
    } else {
      index = unused_.back();
      unused_.pop_back();
    }
    Facet& facet = facets_[index];
    const std::uint32_t mark = facet.mark;
    facet = Facet{.corners = {a, b, c}, .plane = {points_m_[a], points_m_[b], points_m_[c]}, .mark = mark};
    return index;
  }

  /// The last corner is behind the triangle of the others.
  void add_tetrahedron(const std::array<std::uint32_t, 4>& first) {
    const auto [a, b, c, d] = first;
    add_facet(a, b, c);
    add_facet(b, a, d);
    add_facet(c, b, d);
    add_facet(a, c, d);
    facets_[0].beside = {1, 2, 3};
    facets_[1].beside = {0, 3, 2};
    facets_[2].beside = {0, 1, 3};
    facets_[3].beside = {0, 2, 1};
    const std::array<std::uint32_t, 4> all{0, 1, 2, 3};
    for (std::uint32_t i = 0; i < points_m_.size(); ++i)
      if (std::ranges::find(first, i) == first.end()) assign(i, all);
  }

  /// The point goes to the facet that it is farthest in front of, if any.
  void assign(std::uint32_t point, std::span<const std::uint32_t> facets) {
    std::uint32_t best = no_index;
    double best_m = -std::numeric_limits<double>::infinity();
    for (const std::uint32_t index : facets) {
      const OrientedPlane& plane = facets_[index].plane;
      const double height_m = plane.height_m(at(point));
      if (height_m <= best_m || plane.side_of(points_m_[point]) <= 0) continue;
      best = index;
      best_m = height_m;
    }
    if (best != no_index) append(best, point, best_m);
  }

  void append(std::uint32_t index, std::uint32_t point, double height_m) {
    Facet& facet = facets_[index];
    next_[point] = facet.first_outside;
    facet.first_outside = point;
    if (facet.farthest != no_index && height_m <= facet.farthest_m) return;
    facet.farthest = point;
    facet.farthest_m = height_m;
  }

  /// Drops the farthest point of the facet, and the others that are plainly within the tolerance.
  void drop_farthest(std::uint32_t index) {
    Facet& facet = facets_[index];
    const std::uint32_t dropped = facet.farthest;
    std::uint32_t point = std::exchange(facet.first_outside, no_index);
    facet.farthest = no_index;
    while (point != no_index) {
      const std::uint32_t following = next_[point];
      const bool is_near =
          point == dropped || is_within_tolerance(index, point) ||
          std::ranges::any_of(facet.beside, [&](std::uint32_t i) { return is_within_tolerance(i, point); });
      if (!is_near) append(index, point, facet.plane.height_m(at(point)));
      point = following;
    }
  }

  /// The farthest point of the facet becomes a corner, or is within the tolerance.
  void extend_from(std::uint32_t start) {
    const std::uint32_t point = facets_[start].farthest;
    ++mark_;
    visible_.assign(1, start);
    facets_[start].mark = mark_;
    bool is_near = is_within_tolerance(start, point);
    border_.clear();
    for (std::size_t i = 0; i < visible_.size() && !is_near; ++i) {
      const std::uint32_t index = visible_[i];
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t other = facets_[index].beside[k];
        if (facets_[other].mark == mark_) continue;
        if (facets_[other].plane.side_of(points_m_[point]) > 0) {
          facets_[other].mark = mark_;
          visible_.push_back(other);
          is_near = is_near || is_within_tolerance(other, point);
        }
      }
    }
    if (is_near) {
      drop_farthest(start);
      return;
    }
    for (const std::uint32_t index : visible_) {
      const Facet& facet = facets_[index];
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t other = facet.beside[k];
        if (facets_[other].mark == mark_) continue;
        const std::uint32_t from = facet.corners[k], to = facet.corners[(k + 1) % 3];
        const auto& corners = facets_[other].corners;
        const std::uint32_t edge = corners[0] == to ? 0 : corners[1] == to ? 1 : 2;
        border_.push_back({from, to, other, edge});
      }
    }
    replace_visible(point);
  }

  bool is_within_tolerance(std::uint32_t index, std::uint32_t point) const {
    if (tolerance_m_ <= 0.0) return false;
    const Facet& facet = facets_[index];
    if (facet.plane.height_m(at(point)) > tolerance_m_) return false;
    return distance_to_triangle_m({at(facet.corners[0]), at(facet.corners[1]), at(facet.corners[2])},
                                  at(point)) <= tolerance_m_;
  }

  void replace_visible(std::uint32_t point) {
    orphans_.clear();
    for (const std::uint32_t index : visible_) {
      for (std::uint32_t p = facets_[index].first_outside; p != no_index; p = next_[p])
        if (p != point) orphans_.push_back(p);
      facets_[index].is_alive = false;
      unused_.push_back(index);
    }
    added_.clear();
    for (const Edge& edge : border_) {
      const std::uint32_t index = add_facet(edge.from, edge.to, point);
      facets_[index].beside[0] = edge.hidden;
      facets_[edge.hidden].beside[edge.edge_of_hidden] = index;
      facet_from_[edge.from] = index;
      added_.push_back(index);
    }
    for (const std::uint32_t index : added_) {
      const std::uint32_t following = facet_from_[facets_[index].corners[1]];
      facets_[index].beside[1] = following;
      facets_[following].beside[2] = index;
    }
    for (const std::uint32_t orphan : orphans_)
      assign(orphan, added_);
    for (const std::uint32_t index : added_)
      if (facets_[index].farthest != no_index) pending_.push_back(index);
  }

  std::span<const glm::vec3> points_m_;
  double tolerance_m_;
  std::vector<Facet> facets_;
  std::vector<std::uint32_t> unused_;      // facets that are not alive
  std::vector<std::uint32_t> next_;        // of each point, in the list of its facet
  std::vector<std::uint32_t> facet_from_;  // of each corner of the border, the new facet that begins there
  std::deque<std::uint32_t> pending_;
  std::uint32_t mark_ = 0;
  // Used within a step.
  std::vector<std::uint32_t> visible_, added_, orphans_;
  std::vector<Edge> border_;
};

/// Replaces triangles of one plane by triangles of the polygon that they form, without the corners that lie
/// inside it or inside one of its edges.
class CoplanarMerger {
 public:
  CoplanarMerger(std::span<const glm::vec3> points_m, std::vector<glm::uvec3> triangles,
                 std::vector<OrientedPlane> planes)
      : points_m_(points_m), triangles_(std::move(triangles)), planes_(std::move(planes)) {}

  HullTriangles merged() {
    beside_ = neighbors_of(triangles_);
    group();
    HullTriangles result;
    if (groups_.size() == triangles_.size()) {
      result.triangles = std::move(triangles_);
      result.planes = std::move(planes_);
    } else {
      find_corners();
      for (const std::vector<std::uint32_t>& group : groups_)
        add_polygon(group, result);
    }
    for (const glm::uvec3& triangle : result.triangles)
      result.corners.insert(result.corners.end(), {triangle.x, triangle.y, triangle.z});
    std::ranges::sort(result.corners);
    result.corners.erase(std::unique(result.corners.begin(), result.corners.end()), result.corners.end());
    return result;
  }

 private:
  void group() {
    group_of_.assign(triangles_.size(), no_index);
    for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      if (group_of_[seed] != no_index) continue;
      const auto number = static_cast<std::uint32_t>(groups_.size());
      group_of_[seed] = number;
      std::vector<std::uint32_t> group{seed};
      for (std::size_t i = 0; i < group.size(); ++i) {
        for (const std::uint32_t other : beside_[group[i]]) {
          if (group_of_[other] != no_index || !lies_in(planes_[group[i]], triangles_[other])) continue;
          group_of_[other] = number;
          group.push_back(other);
        }
      }
      groups_.push_back(std::move(group));
    }
  }

  bool lies_in(const OrientedPlane& plane, const glm::uvec3& triangle) const {
    return plane.side_of(points_m_[triangle.x]) == 0 && plane.side_of(points_m_[triangle.y]) == 0 &&
           plane.side_of(points_m_[triangle.z]) == 0;
  }

  /// Corners of the hull belong to three planes.
  void find_corners() {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> planes_of;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (int i = 0; i < 3; ++i)
        planes_of.emplace_back(triangles_[t][i], group_of_[t]);
    std::ranges::sort(planes_of);
    planes_of.erase(std::unique(planes_of.begin(), planes_of.end()), planes_of.end());
    plane_count_.assign(points_m_.size(), 0);
    for (const auto& [corner, plane] : planes_of)
      ++plane_count_[corner];
    next_.assign(points_m_.size(), no_index);
  }

  void add_polygon(const std::vector<std::uint32_t>& group, HullTriangles& result) {
    if (group.size() == 1) {
      const glm::uvec3& t = triangles_[group[0]];
      if (plane_count_[t.x] > 2 && plane_count_[t.y] > 2 && plane_count_[t.z] > 2) {
        result.triangles.push_back(t);
        result.planes.push_back(planes_[group[0]]);
        return;
      }
    }
    std::uint32_t start = no_index, edges = 0;
    for (const std::uint32_t t : group) {
      for (int i = 0; i < 3; ++i) {
        if (group_of_[beside_[t][static_cast<std::size_t>(i)]] == group_of_[t]) continue;
        start = triangles_[t][i];
        next_[start] = triangles_[t][(i + 1) % 3];
        ++edges;
      }
    }
    std::vector<std::uint32_t> loop;
    for (std::uint32_t i = 0, corner = start; i < edges; ++i, corner = next_[corner])
      if (plane_count_[corner] > 2) loop.push_back(corner);
    for (std::size_t i = 2; i < loop.size(); ++i) {
      result.triangles.emplace_back(loop[0], loop[i - 1], loop[i]);
      result.planes.emplace_back(points_m_[loop[0]], points_m_[loop[i - 1]], points_m_[loop[i]]);
    }
  }

  std::span<const glm::vec3> points_m_;
  std::vector<glm::uvec3> triangles_;
  std::vector<OrientedPlane> planes_;
  std::vector<std::array<std::uint32_t, 3>> beside_;
  std::vector<std::uint32_t> group_of_;
  std::vector<std::vector<std::uint32_t>> groups_;
  std::vector<std::uint32_t> plane_count_;  // of each point
  std::vector<std::uint32_t> next_;         // of each corner of a border
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> neighbors_of(const std::vector<glm::uvec3>& triangles) {
  struct Edge {
    std::uint32_t low, high, triangle, side;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      const auto [low, high] =
          std::minmax({triangles[t][static_cast<int>(i)], triangles[t][static_cast<int>((i + 1) % 3)]});
      edges.push_back({low, high, t, i});
    }
  }
  std::ranges::sort(edges, {}, [](const Edge& edge) { return std::pair(edge.low, edge.high); });
  std::vector<std::array<std::uint32_t, 3>> beside(triangles.size());
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
    beside[edges[i].triangle][edges[i].side] = edges[i + 1].triangle;
    beside[edges[i + 1].triangle][edges[i + 1].side] = edges[i].triangle;
  }
  return beside;
}

std::optional<HullTriangles> hull_triangles(std::span<const glm::vec3> points_m, double tolerance_m) {
  Quickhull quickhull(points_m, tolerance_m);
  if (!quickhull.make()) return std::nullopt;
  std::vector<glm::uvec3> triangles;
  std::vector<OrientedPlane> planes;
  for (const Quickhull::Facet& facet : quickhull.facets()) {
    if (!facet.is_alive) continue;
    triangles.emplace_back(facet.corners[0], facet.corners[1], facet.corners[2]);
    planes.push_back(facet.plane);
  }
  return CoplanarMerger(points_m, std::move(triangles), std::move(planes)).merged();
}

std::optional<ThinDirection> thin_direction(const HullTriangles& hull, std::span<const glm::vec3> points_m,
                                            double limit_m) {
  std::uint32_t first = hull.corners.front();  // a corner that is far behind the last plane
  for (std::uint32_t t = 0; t < hull.planes.size(); ++t) {
    const OrientedPlane& plane = hull.planes[t];
    double extent_m = -plane.height_m(glm::dvec3(points_m[first]));
    for (std::size_t i = 0; i < hull.corners.size() && extent_m < limit_m; ++i) {
      const double depth_m = -plane.height_m(glm::dvec3(points_m[hull.corners[i]]));
      if (depth_m <= extent_m) continue;
      extent_m = depth_m;
      first = hull.corners[i];
    }
    if (extent_m < limit_m) return ThinDirection{t, extent_m};
  }
  return std::nullopt;
}

namespace {

std::uint64_t edge_key(std::uint32_t from, std::uint32_t to) {
  return std::uint64_t{from} << 32 | to;
}

}  // namespace

TrianglesByEdge::TrianglesByEdge(std::span<const glm::uvec3> triangles) {
  edges_.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (int i = 0; i < 3; ++i)
      edges_.emplace_back(edge_key(triangles[t][i], triangles[t][(i + 1) % 3]), t);
  std::ranges::sort(edges_);
}

std::optional<std::uint32_t> TrianglesByEdge::find(std::uint32_t from, std::uint32_t to) const {
  const std::uint64_t key = edge_key(from, to);
  const auto edge = std::ranges::lower_bound(edges_, std::pair(key, 0u));
  if (edge == edges_.end() || edge->first != key) return std::nullopt;
  return edge->second;
}

}  // namespace rtstdb
