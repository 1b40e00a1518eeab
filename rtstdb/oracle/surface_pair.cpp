#include "rtstdb/oracle/surface_pair.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <utility>

#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {
namespace {

double boxes_apart_m(const SurfaceBox& a, const SurfaceBox& b, const glm::dvec3& move_a_m) noexcept {
  const glm::dvec3 apart =
      glm::max(a.minimum_m + move_a_m - b.maximum_m, b.minimum_m - a.maximum_m - move_a_m);
  return glm::length(glm::max(apart, 0.0));
}

struct Segment {
  glm::dvec3 from_m, to_m;
};

/// The shortest segment between two segments; ends included (Ericson, Real-Time Collision Detection, 2005,
/// 5.1.9, with every end tried, which is right for nearly parallel segments).
Segment between_segments(const Segment& a, const Segment& b) noexcept {
  const auto on = [](const Segment& s, const glm::dvec3& p) {
    const glm::dvec3 along = s.to_m - s.from_m;
    const double square = glm::dot(along, along);
    const double t = square > 0.0 ? std::clamp(glm::dot(p - s.from_m, along) / square, 0.0, 1.0) : 0.0;
    return s.from_m + t * along;
  };
  Segment best{a.from_m, on(b, a.from_m)};
  const auto offer = [&best](const glm::dvec3& p, const glm::dvec3& q) {
    if (glm::distance(p, q) < glm::distance(best.from_m, best.to_m)) best = {p, q};
  };
  offer(a.to_m, on(b, a.to_m));
  offer(on(a, b.from_m), b.from_m);
  offer(on(a, b.to_m), b.to_m);
  const glm::dvec3 along_a = a.to_m - a.from_m;
  const glm::dvec3 along_b = b.to_m - b.from_m;
  const glm::dvec3 across = glm::cross(along_a, along_b);
  const double square = glm::dot(across, across);
  if (square <= 1e-24 * glm::dot(along_a, along_a) * glm::dot(along_b, along_b)) return best;
  const glm::dvec3 apart = b.from_m - a.from_m;
  const double s = glm::dot(glm::cross(apart, along_b), across) / square;
  const double t = glm::dot(glm::cross(apart, along_a), across) / square;
  if (s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0) offer(a.from_m + s * along_a, b.from_m + t * along_b);
  return best;
}

Segment edge_of(const SurfaceTriangle& c, std::size_t i) noexcept {
  return {c[i], c[(i + 1) % 3]};
}

/// The point at which the segment pierces the triangle, from one side of its plane to the other.
std::optional<glm::dvec3> pierced_at(const Segment& segment, const SurfaceTriangle& c) noexcept {
  const glm::dvec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
  const double from = glm::dot(segment.from_m - c[0], normal);
  const double to = glm::dot(segment.to_m - c[0], normal);
  if (!((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0))) return std::nullopt;
  const glm::dvec3 p = segment.from_m + from / (from - to) * (segment.to_m - segment.from_m);
  for (std::size_t i = 0; i < 3; ++i) {
    const Segment edge = edge_of(c, i);
    if (glm::dot(glm::cross(edge.to_m - edge.from_m, p - edge.from_m), normal) <= 0.0) return std::nullopt;
  }
  return p;
}

double crossing_margin_m(const Segment& segment, const SurfaceTriangle& c) noexcept {
  double margin_m = std::min(glm::distance(nearest_on_triangle(c, segment.from_m).point, segment.from_m),
                             glm::distance(nearest_on_triangle(c, segment.to_m).point, segment.to_m));
  for (std::size_t i = 0; i < 3; ++i) {
    const Segment between = between_segments(segment, edge_of(c, i));
    margin_m = std::min(margin_m, glm::distance(between.from_m, between.to_m));
  }
  return margin_m;
}

/// Calls visit(point, edge, triangle) for each edge of one triangle that pierces the other one.
template <class Visit>
void each_piercing(const SurfaceTriangle& a, const SurfaceTriangle& b, Visit&& visit) {
  for (const auto& [edges, pierced] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Segment edge = edge_of(*edges, i);
      if (const auto p = pierced_at(edge, *pierced)) visit(*p, edge, *pierced);
    }
  }
}

/// Walks both trees: pairs of nodes that are nearer than `limit_m` apart, the nearest ones first, and calls
/// visit(first triangle, second triangle) for those of their leaves. The visitor may reduce the limit.
template <class Visit>
class PairWalk {
 public:
  PairWalk(const SurfaceBody& first, const SurfaceBody& second, const glm::dvec3& move_first_m,
           const double& limit_m, Visit& visit)
      : first_(first), second_(second), move_m_(move_first_m), limit_m_(limit_m), visit_(visit) {}

  void walk(std::uint32_t a, std::uint32_t b) {
    const auto& of_a = first_.nodes()[a];
    const auto& of_b = second_.nodes()[b];
    if (of_a.count != 0 && of_b.count != 0) {
      for (std::uint32_t i = 0; i < of_a.count; ++i)
        for (std::uint32_t k = 0; k < of_b.count; ++k)
          visit_(first_.order()[of_a.first + i], second_.order()[of_b.first + k]);
      return;
    }
    const bool splits_a = of_b.count != 0 || (of_a.count == 0 && size_m(of_a) >= size_m(of_b));
    std::array<std::pair<std::uint32_t, std::uint32_t>, 2> children{
        splits_a ? std::pair{of_a.first, b} : std::pair{a, of_b.first},
        splits_a ? std::pair{of_a.first + 1, b} : std::pair{a, of_b.first + 1}};
    std::array<double, 2> apart_m{};
    for (std::size_t i = 0; i < 2; ++i)
      apart_m[i] = boxes_apart_m(first_.nodes()[children[i].first].box,
                                 second_.nodes()[children[i].second].box, move_m_);
    const std::size_t nearer = apart_m[1] < apart_m[0] ? 1 : 0;
    for (const std::size_t i : {nearer, 1 - nearer})
      if (apart_m[i] <= limit_m_) walk(children[i].first, children[i].second);
  }

 private:
  static double size_m(const SurfaceBody::Node& node) {
    return glm::distance(node.box.minimum_m, node.box.maximum_m);
  }

  const SurfaceBody& first_;
  const SurfaceBody& second_;
  glm::dvec3 move_m_;
  const double& limit_m_;
  Visit& visit_;
};

double triangle_boxes_apart_m(const SurfaceTriangle& a, const SurfaceTriangle& b) noexcept {
  const SurfaceBox of_a{glm::min(glm::min(a[0], a[1]), a[2]), glm::max(glm::max(a[0], a[1]), a[2])};
  const SurfaceBox of_b{glm::min(glm::min(b[0], b[1]), b[2]), glm::max(glm::max(b[0], b[1]), b[2])};
  return boxes_apart_m(of_a, of_b, glm::dvec3(0.0));
}

/// The shortest segment between two triangles, from a corner to a triangle or between edges; where an edge
/// pierces the other triangle, the point there.
Segment between_triangles(const SurfaceTriangle& a, const SurfaceTriangle& b) {
  Segment best{glm::dvec3(0.0), glm::dvec3(std::numeric_limits<double>::infinity())};
  double best_m = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Segment& segment) {
    const double length_m = glm::distance(segment.from_m, segment.to_m);
    if (length_m >= best_m) return;
    best_m = length_m;
    best = segment;
  };
  for (std::size_t i = 0; i < 3; ++i) {
    offer({a[i], nearest_on_triangle(b, a[i]).point});
    offer({nearest_on_triangle(a, b[i]).point, b[i]});
    for (std::size_t k = 0; k < 3; ++k)
      offer(between_segments(edge_of(a, i), edge_of(b, k)));
  }
  each_piercing(a, b, [&](const glm::dvec3& p, const Segment&, const SurfaceTriangle&) { offer({p, p}); });
  return best;
}

}  // namespace

double triangles_apart_m(const SurfaceTriangle& a, const SurfaceTriangle& b) {
  const Segment segment = between_triangles(a, b);
  return glm::distance(segment.from_m, segment.to_m);
}

SurfaceGap surface_gap(const SurfaceBody& first, const SurfaceBody& second, const glm::dvec3& move_first_m) {
  SurfaceGap gap;
  double limit_m = gap.distance_m;
  const auto visit = [&](std::uint32_t i, std::uint32_t k) {
    SurfaceTriangle moved = first.triangles()[i];
    for (glm::dvec3& corner : moved)
      corner += move_first_m;
    if (triangle_boxes_apart_m(moved, second.triangles()[k]) >= gap.distance_m) return;
    const Segment segment = between_triangles(moved, second.triangles()[k]);
    const double distance_m = glm::distance(segment.from_m, segment.to_m);
    if (distance_m >= gap.distance_m) return;
    gap = {distance_m, segment.from_m, segment.to_m, i, k};
    limit_m = distance_m;
  };
  PairWalk(first, second, move_first_m, limit_m, visit).walk(0, 0);
  return gap;
}

std::optional<SurfaceCrossing> surface_crossing(const SurfaceBody& first, const SurfaceBody& second) {
  std::optional<SurfaceCrossing> best;
  const double limit_m = 0.0;
  const auto visit = [&](std::uint32_t i, std::uint32_t k) {
    const SurfaceTriangle& a = first.triangles()[i];
    const SurfaceTriangle& b = second.triangles()[k];
    if (triangle_boxes_apart_m(a, b) > 0.0) return;
    each_piercing(a, b, [&](const glm::dvec3& p, const Segment& edge, const SurfaceTriangle& pierced) {
      const double margin_m = crossing_margin_m(edge, pierced);
      if (!best || margin_m > best->margin_m) best = {margin_m, p, i, k};
    });
  };
  if (boxes_apart_m(first.box(), second.box(), glm::dvec3(0.0)) > 0.0) return best;
  PairWalk(first, second, glm::dvec3(0.0), limit_m, visit).walk(0, 0);
  return best;
}

}  // namespace rtstdb::oracle
