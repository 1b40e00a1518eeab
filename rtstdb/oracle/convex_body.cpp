#include "rtstdb/oracle/convex_body.hpp"

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {
namespace {

using Corner = std::array<double, 3>;

bool are_parallel(const glm::dvec3& a, const glm::dvec3& b) {
  return glm::length(glm::cross(a, b)) <= parallel_sine;
}

void add_direction(std::vector<glm::dvec3>& directions, const glm::dvec3& unit) {
  for (const glm::dvec3& known : directions)
    if (are_parallel(known, unit)) return;
  directions.push_back(unit);
}

/// Zero: the triangle has no area.
glm::dvec3 unit_normal(const std::array<glm::dvec3, 3>& c) {
  const glm::dvec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
  const double area_m2 = glm::length(normal);
  const double sides_m2 = glm::length(c[1] - c[0]) * glm::length(c[2] - c[0]);
  return area_m2 > 1e-12 * sides_m2 ? normal / area_m2 : glm::dvec3(0.0);
}

/// An edge with the normal of one of its triangles, and whether another of its triangles has another one.
struct EdgeFaces {
  std::array<glm::dvec3, 2> ends_m;
  glm::dvec3 normal{0.0};
  bool is_bent = false;
};

/// Moves the corners that reach farthest along the axes to the front.
void put_extremes_first(std::vector<glm::dvec3>& corners_m) {
  std::size_t next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const auto rest = corners_m.begin() + static_cast<std::ptrdiff_t>(next);
      const auto farthest = std::max_element(rest, corners_m.end(), [&](const auto& a, const auto& b) {
        return sign * a[axis] < sign * b[axis];
      });
      if (farthest == corners_m.end()) return;
      std::iter_swap(rest, farthest);
      ++next;
    }
  }
}

void add_edges(ConvexBody& body, const std::map<std::pair<Corner, Corner>, EdgeFaces>& edges) {
  for (const auto& [ends, edge] : edges) {
    if (!edge.is_bent) continue;
    body.edges_m.push_back(edge.ends_m);
    add_direction(body.edge_directions, glm::normalize(edge.ends_m[1] - edge.ends_m[0]));
  }
  if (body.normals.size() != 1) return;
  for (const glm::dvec3& edge : body.edge_directions)
    add_direction(body.normals, glm::cross(body.normals[0], edge));
}

void measure(ConvexBody& body) {
  for (const glm::dvec3& p : body.corners_m)
    body.largest_coordinate_m =
        std::max({body.largest_coordinate_m, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  for (const std::uint32_t i : body.with_plane) {
    const auto& triangle = body.triangles_m[i];
    const glm::dvec3 normal = unit_normal(triangle);
    for (const glm::dvec3& p : body.corners_m)
      body.bulge_m = std::max(body.bulge_m, glm::dot(p - triangle[0], normal));
  }
}

/// Calls visit(unit axis) with the normals of all faces that the Minkowski difference may have, until a call
/// returns true.
template <class Visit>
bool any_axis(const ConvexBody& first, const ConvexBody& second, Visit&& visit) {
  for (const ConvexBody* body : {&first, &second}) {
    for (const glm::dvec3& normal : body->normals)
      if (visit(normal) || visit(-normal)) return true;
  }
  for (const glm::dvec3& a : first.edge_directions) {
    for (const glm::dvec3& b : second.edge_directions) {
      const glm::dvec3 across = glm::cross(a, b);
      const double sine = glm::length(across);
      if (sine <= parallel_sine) continue;
      const glm::dvec3 axis = across / sine;
      if (visit(axis) || visit(-axis)) return true;
    }
  }
  return false;
}

/// Calls visit(unit axis) with axes at that angle to the unit axis `n`, until a call returns true.
template <class Visit>
bool any_axis_around(const glm::dvec3& n, double angle_rad, Visit&& visit) {
  const glm::dvec3 u = glm::normalize(
      glm::cross(n, std::abs(n.x) < 0.5 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0)));
  const glm::dvec3 v = glm::cross(n, u);
  constexpr int count = 24;
  for (int i = 0; i < count; ++i) {
    const double turn_rad = 2.0 * std::numbers::pi * i / count;
    const glm::dvec3 across = std::cos(turn_rad) * u + std::sin(turn_rad) * v;
    if (visit(std::cos(angle_rad) * n + std::sin(angle_rad) * across)) return true;
  }
  return false;
}

/// A sphere around a part of a body: parts whose spheres are farther apart than a known distance need no
/// test.
struct PartSphere {
  glm::dvec3 center_m;
  double radius_m;
};

template <std::size_t count>
std::vector<PartSphere> spheres_of(const std::vector<std::array<glm::dvec3, count>>& parts) {
  std::vector<PartSphere> spheres;
  for (const auto& corners : parts) {
    PartSphere sphere{glm::dvec3(0.0), 0.0};
    for (const glm::dvec3& p : corners)
      sphere.center_m += p / static_cast<double>(count);
    for (const glm::dvec3& p : corners)
      sphere.radius_m = std::max(sphere.radius_m, glm::distance(p, sphere.center_m));
    spheres.push_back(sphere);
  }
  return spheres;
}

/// The nearest points of two lines, if both are within the segments. Nearest points at an end of a segment
/// are those of a corner and a triangle.
void offer_edges(const std::array<glm::dvec3, 2>& a, const std::array<glm::dvec3, 2>& b, BodyDistance& best) {
  const glm::dvec3 along_a = a[1] - a[0];
  const glm::dvec3 along_b = b[1] - b[0];
  const glm::dvec3 across = glm::cross(along_a, along_b);
  const double square = glm::dot(across, across);
  if (square <= 1e-24 * glm::dot(along_a, along_a) * glm::dot(along_b, along_b)) return;
  const glm::dvec3 between = b[0] - a[0];
  const double s = glm::dot(glm::cross(between, along_b), across) / square;
  const double t = glm::dot(glm::cross(between, along_a), across) / square;
  if (s < 0.0 || s > 1.0 || t < 0.0 || t > 1.0) return;
  const glm::dvec3 p_a = a[0] + s * along_a;
  const glm::dvec3 p_b = b[0] + t * along_b;
  const double distance_m = glm::distance(p_a, p_b);
  if (distance_m < best.distance_m) best = {distance_m, p_a, p_b};
}

void offer_corners(const ConvexBody& of_corners, const ConvexBody& of_triangles, bool swapped,
                   BodyDistance& best) {
  const auto spheres = spheres_of(of_triangles.triangles_m);
  for (const glm::dvec3& corner : of_corners.corners_m) {
    for (std::size_t i = 0; i < spheres.size(); ++i) {
      if (glm::distance(corner, spheres[i].center_m) - spheres[i].radius_m > best.distance_m) continue;
      const glm::dvec3 on_triangle = nearest_on_triangle(of_triangles.triangles_m[i], corner).point;
      const double distance_m = glm::distance(corner, on_triangle);
      if (distance_m >= best.distance_m) continue;
      best = swapped ? BodyDistance{distance_m, on_triangle, corner}
                     : BodyDistance{distance_m, corner, on_triangle};
    }
  }
}

}  // namespace

ConvexBody convex_body(const PosedEntity& entity, const glm::dvec3& origin_m) {
  const glm::dvec3 offset_m = entity.pose.p_world_m - origin_m;
  ConvexBody body;
  std::map<Corner, glm::dvec3> corners;
  std::map<std::pair<Corner, Corner>, EdgeFaces> edges;
  for (std::uint32_t i = 0; i < entity.mesh->triangle_count(); ++i) {
    auto in_mesh = entity.mesh->corners(i);
    if (entity.mesh->inside_out()) std::swap(in_mesh[1], in_mesh[2]);
    if (entity.mesh->known_normal(i) != glm::dvec3(0.0)) body.with_plane.push_back(i);
    std::array<glm::dvec3, 3> triangle;
    std::array<Corner, 3> key;
    for (std::size_t k = 0; k < 3; ++k) {
      triangle[k] = offset_m + entity.pose.q_world * (entity.state->row.scale * in_mesh[k]);
      key[k] = {in_mesh[k].x, in_mesh[k].y, in_mesh[k].z};
      corners.try_emplace(key[k], triangle[k]);
    }
    body.triangles_m.push_back(triangle);
    const glm::dvec3 normal = unit_normal(triangle);
    const bool has_normal = normal != glm::dvec3(0.0);
    if (has_normal) add_direction(body.normals, normal);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if (key[k] == key[next]) continue;
      const auto place = key[k] < key[next] ? std::pair(key[k], key[next]) : std::pair(key[next], key[k]);
      const auto [edge, is_new] = edges.try_emplace(place, EdgeFaces{{triangle[k], triangle[next]}, normal});
      const bool same_plane = has_normal && are_parallel(edge->second.normal, normal) &&
                              glm::dot(edge->second.normal, normal) > 0.0;
      if (!is_new && !same_plane) edge->second.is_bent = true;
    }
  }
  for (const auto& [key, corner_m] : corners)
    body.corners_m.push_back(corner_m);
  put_extremes_first(body.corners_m);
  add_edges(body, edges);
  const Bounds& bounds = entity.mesh->bounds();
  body.diagonal_m =
      glm::length(entity.state->row.scale * (glm::dvec3(bounds.maximum_m) - glm::dvec3(bounds.minimum_m)));
  measure(body);
  return body;
}

double gap_along_m(const ConvexBody& first, const ConvexBody& second, const glm::dvec3& axis,
                   double floor_m) noexcept {
  double low_m = std::numeric_limits<double>::infinity();
  double high_m = -std::numeric_limits<double>::infinity();
  const std::size_t count = std::max(first.corners_m.size(), second.corners_m.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (i < first.corners_m.size()) low_m = std::min(low_m, glm::dot(axis, first.corners_m[i]));
    if (i < second.corners_m.size()) high_m = std::max(high_m, glm::dot(axis, second.corners_m[i]));
    if (low_m - high_m <= floor_m) break;  // more corners can only reduce it
  }
  return low_m - high_m;
}

AxisGap largest_gap(const ConvexBody& first, const ConvexBody& second) {
  AxisGap best;
  any_axis(first, second, [&](const glm::dvec3& axis) {
    const double gap_m = gap_along_m(first, second, axis, best.gap_m);
    if (gap_m > best.gap_m) best = {gap_m, axis};
    return best.gap_m > 0.0;
  });
  return best;
}

bool has_other_axis(const ConvexBody& first, const ConvexBody& second, const glm::dvec3& n, double angle_rad,
                    double floor_m) {
  const double cosine = std::cos(angle_rad);
  const auto is_above = [&](const glm::dvec3& axis) {
    return gap_along_m(first, second, axis, floor_m) > floor_m;
  };
  return any_axis_around(n, angle_rad, is_above) || any_axis(first, second, [&](const glm::dvec3& axis) {
           return glm::dot(axis, n) < cosine && is_above(axis);
         });
}

bool has_axis_near(const ConvexBody& first, const ConvexBody& second, const glm::dvec3& n, double angle_rad,
                   double floor_m) {
  const double cosine = std::cos(angle_rad);
  const auto is_above = [&](const glm::dvec3& axis) {
    return gap_along_m(first, second, axis, floor_m) > floor_m;
  };
  return is_above(n) || any_axis_around(n, angle_rad, is_above) ||
         any_axis(first, second,
                  [&](const glm::dvec3& axis) { return glm::dot(axis, n) >= cosine && is_above(axis); });
}

BodyDistance surface_distance(const ConvexBody& first, const ConvexBody& second) {
  BodyDistance best;
  offer_corners(first, second, false, best);
  offer_corners(second, first, true, best);
  const auto of_first = spheres_of(first.edges_m);
  const auto of_second = spheres_of(second.edges_m);
  for (std::size_t i = 0; i < of_first.size(); ++i) {
    for (std::size_t j = 0; j < of_second.size(); ++j) {
      const double at_least_m = glm::distance(of_first[i].center_m, of_second[j].center_m) -
                                of_first[i].radius_m - of_second[j].radius_m;
      if (at_least_m <= best.distance_m) offer_edges(first.edges_m[i], second.edges_m[j], best);
    }
  }
  return best;
}

double surface_distance_m(const ConvexBody& body, const glm::dvec3& point_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const auto& triangle : body.triangles_m)
    nearest_m = std::min(nearest_m, glm::distance(point_m, nearest_on_triangle(triangle, point_m).point));
  return nearest_m;
}

double depth_inside_m(const ConvexBody& body, const glm::dvec3& point_m) {
  double depth_m = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : body.with_plane) {
    const auto& triangle = body.triangles_m[i];
    depth_m = std::min(depth_m, glm::dot(unit_normal(triangle), triangle[0] - point_m));
  }
  return depth_m;
}

}  // namespace rtstdb::oracle
