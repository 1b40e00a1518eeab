#include "rtstdb/geometry/flat_hull.hpp"

#include <glm/common.hpp>
#include <glm/ext/vector_double2.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace rtstdb {
namespace {

/// Axes of a plane: u, v and the normal are right-handed.
struct PlaneAxes {
  glm::dvec3 origin_m, u, v;

  PlaneAxes(const glm::dvec3& normal, const glm::vec3& origin) : origin_m(origin) {
    const glm::dvec3 size = glm::abs(normal);
    const glm::dvec3 across = size.x <= size.y && size.x <= size.z ? glm::dvec3(1.0, 0.0, 0.0)
                              : size.y <= size.z                   ? glm::dvec3(0.0, 1.0, 0.0)
                                                                   : glm::dvec3(0.0, 0.0, 1.0);
    u = glm::normalize(glm::cross(across, normal));
    v = glm::cross(normal, u);
  }
  glm::dvec2 of(const glm::vec3& p_m) const {
    const glm::dvec3 off = glm::dvec3(p_m) - origin_m;
    return {glm::dot(u, off), glm::dot(v, off)};
  }
};

double cross(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// Appends the corners between two corners of the polygon, counter-clockwise (quickhull in the plane).
void add_between(const std::vector<glm::dvec2>& at, std::uint32_t from, std::uint32_t to,
                 const std::vector<std::uint32_t>& outside, double tolerance_m,
                 std::vector<std::uint32_t>& loop) {
  const double length_m = glm::length(at[to] - at[from]);
  std::uint32_t farthest = from;
  double max_m = tolerance_m;
  for (const std::uint32_t point : outside) {
    const double height_m = -cross(at[to] - at[from], at[point] - at[from]) / length_m;
    if (height_m > max_m) max_m = height_m, farthest = point;
  }
  if (farthest == from) return;
  std::vector<std::uint32_t> before, after;
  for (const std::uint32_t point : outside) {
    if (cross(at[farthest] - at[from], at[point] - at[from]) < 0.0) before.push_back(point);
    if (cross(at[to] - at[farthest], at[point] - at[farthest]) < 0.0) after.push_back(point);
  }
  add_between(at, from, farthest, before, tolerance_m, loop);
  loop.push_back(farthest);
  add_between(at, farthest, to, after, tolerance_m, loop);
}

double distance_to_segment_m(const glm::dvec2& p, const glm::dvec2& a, const glm::dvec2& b) {
  const glm::dvec2 along = b - a;
  const double share = std::clamp(glm::dot(p - a, along) / glm::dot(along, along), 0.0, 1.0);
  return glm::length(p - a - share * along);
}

/// How often each edge is passed by triangles that face the normal, counted from its lower corner to its
/// higher one, less the passes back: zero inside a sheet, where triangles of both sides of the edge face it.
class SheetBorder {
 public:
  void add(const glm::uvec3& triangle, int times) {
    for (int i = 0; i < 3; ++i)
      add(triangle[i], triangle[(i + 1) % 3], times);
  }

  /// Triangles that are nearly segments: their longest edge is the other two edges. Where a sheet ends at
  /// the longest edge, it goes on beyond the triangle.
  void pass(std::vector<glm::uvec3> needles) {  // the longest edge from the first corner to the second one
    for (bool changes = true; changes && !needles.empty();) {
      const std::size_t before = needles.size();
      std::erase_if(needles, [&](const glm::uvec3& needle) {
        const int times = count(needle.x, needle.y);
        if (times != 0) add(needle, -times);
        return times != 0;
      });
      changes = needles.size() < before;
    }
  }

  /// Whether visit(from, to) holds for all edges at which a sheet ends.
  template <class Visit>
  bool all(Visit&& visit) const {
    return std::ranges::all_of(counts_, [&](const auto& edge) {
      return edge.second == 0 || visit(edge.first.first, edge.first.second);
    });
  }

 private:
  void add(std::uint32_t from, std::uint32_t to, int times) {
    if (from != to) counts_[std::minmax(from, to)] += from < to ? times : -times;
  }
  int count(std::uint32_t from, std::uint32_t to) const {
    const auto found = counts_.find(std::minmax(from, to));
    return found == counts_.end() ? 0 : from < to ? found->second : -found->second;
  }

  std::map<std::pair<std::uint32_t, std::uint32_t>, int> counts_;
};

}  // namespace

std::optional<ConvexHull> flat_hull(std::span<const glm::vec3> points_m, const glm::dvec3& normal,
                                    double tolerance_m) {
  const PlaneAxes axes(normal, points_m[0]);
  std::vector<glm::dvec2> at;
  std::vector<std::uint32_t> all;
  for (const glm::vec3& p_m : points_m) {
    all.push_back(static_cast<std::uint32_t>(at.size()));
    at.push_back(axes.of(p_m));
  }
  const auto farthest_from = [&](std::uint32_t point) {
    return *std::ranges::max_element(all, {},
                                     [&](std::uint32_t i) { return glm::length(at[i] - at[point]); });
  };
  const std::uint32_t first = farthest_from(0), last = farthest_from(first);
  if (at[first] == at[last]) return std::nullopt;
  std::vector<std::uint32_t> loop{first};
  add_between(at, first, last, all, tolerance_m, loop);
  loop.push_back(last);
  add_between(at, last, first, all, tolerance_m, loop);
  const auto count = static_cast<std::uint32_t>(loop.size());
  if (count < 3) return std::nullopt;
  ConvexHull hull;
  for (const std::uint32_t corner : loop) {
    hull.face_corners.push_back(static_cast<std::uint32_t>(hull.corners_m.size()));
    hull.corners_m.push_back(points_m[corner]);
  }
  for (std::uint32_t i = count; i-- > 0;)
    hull.face_corners.push_back(i);
  hull.faces = {{.normal = glm::vec3(normal), .first_corner = 0, .corner_count = count},
                {.normal = glm::vec3(-normal), .first_corner = count, .corner_count = count}};
  return hull;
}

bool covers_polygon(const ConvexHull& flat, std::span<const glm::vec3> points_m,
                    std::span<const glm::uvec3> triangles, double tolerance_m) {
  const PlaneAxes axes(glm::dvec3(flat.faces[0].normal), flat.corners_m[0]);
  std::vector<glm::dvec2> at, polygon;
  for (const glm::vec3& p_m : points_m)
    at.push_back(axes.of(p_m));
  for (const glm::vec3& corner_m : flat.corners_m)
    polygon.push_back(axes.of(corner_m));
  double polygon_m2 = 0.0, sheet_m2 = 0.0;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    polygon_m2 += 0.5 * cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
  SheetBorder border;
  std::vector<glm::uvec3> needles;
  for (const glm::uvec3& t : triangles) {
    const double twice_area = cross(at[t.y] - at[t.x], at[t.z] - at[t.x]);
    std::array<double, 3> lengths_m{};
    for (int i = 0; i < 3; ++i)
      lengths_m[static_cast<std::size_t>(i)] = glm::length(at[t[(i + 1) % 3]] - at[t[i]]);
    const auto longest = std::ranges::max_element(lengths_m);
    if (std::abs(twice_area) <= tolerance_m * *longest) {
      const auto i = static_cast<int>(longest - lengths_m.begin());
      needles.emplace_back(t[i], t[(i + 1) % 3], t[(i + 2) % 3]);
    } else if (twice_area > 0.0) {
      border.add(t, 1);
      sheet_m2 += 0.5 * twice_area;
    }
  }
  border.pass(std::move(needles));
  if (!(sheet_m2 > 0.5 * polygon_m2)) return false;
  const auto is_at_border = [&](const glm::dvec2& p) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < polygon.size(); ++i)
      nearest_m =
          std::min(nearest_m, distance_to_segment_m(p, polygon[i], polygon[(i + 1) % polygon.size()]));
    return nearest_m <= 2.0 * tolerance_m;
  };
  return border.all([&](std::uint32_t from, std::uint32_t to) {
    return is_at_border(at[from]) && is_at_border(at[to]) && is_at_border(0.5 * (at[from] + at[to]));
  });
}

}  // namespace rtstdb
