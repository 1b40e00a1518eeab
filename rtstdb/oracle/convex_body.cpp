#include "rtstdb/oracle/convex_body.hpp"

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <map>

#include "rtstdb/geometry/ulp.hpp"
#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {
namespace {

using Corner = std::array<float, 3>;

/// Sine of the angle by which the end of an arc may be beyond the other arc's plane, for arcs that count as
/// crossing. A pair that does not cross gives an axis that is tested for nothing.
constexpr double arc_tolerance = 1e-7;

/// Zero: the triangle has no area.
glm::dvec3 unit_normal(const std::array<glm::dvec3, 3>& c) {
  const glm::dvec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
  const double area_m2 = glm::length(normal);
  return area_m2 > 0.0 ? normal / area_m2 : glm::dvec3(0.0);
}

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

/// The hull of the mesh's corners; of a flat body its triangles.
TriangleMesh hull_of(const MeshTree& mesh) {
  std::map<Corner, std::uint32_t> numbers;
  TriangleMesh all;
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    auto corners_m = mesh.corners(i);
    if (mesh.inside_out()) std::swap(corners_m[1], corners_m[2]);
    glm::uvec3 triangle;
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 p(corners_m[static_cast<std::size_t>(k)]);
      const auto [number, is_new] =
          numbers.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(all.positions_m.size()));
      if (is_new) all.positions_m.push_back(p);
      triangle[k] = number->second;
    }
    all.triangles.push_back(triangle);
  }
  auto hull = make_hull(all.positions_m);
  return hull ? std::move(hull).value() : all;
}

void add_faces(ConvexBody& body, const TriangleMesh& hull, const std::vector<glm::dvec3>& posed_m) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, glm::dvec3> normals;  // by directed edge
  for (const glm::uvec3& t : hull.triangles) {
    const std::array corners_m{posed_m[t.x], posed_m[t.y], posed_m[t.z]};
    const glm::dvec3 normal = unit_normal(corners_m);
    body.faces.push_back({corners_m, normal});
    if (normal == glm::dvec3(0.0)) continue;
    body.normals.push_back(normal);
    for (int k = 0; k < 3; ++k)
      normals.emplace(std::pair(t[k], t[(k + 1) % 3]), normal);
  }
  for (const auto& [edge, normal] : normals) {
    const auto beyond = normals.find({edge.second, edge.first});
    if (beyond == normals.end() || edge.first > edge.second) continue;
    const std::array ends_m{posed_m[edge.first], posed_m[edge.second]};
    if (glm::dot(normal, beyond->second) > -0.999999999) {
      body.edges.push_back({ends_m, {normal, beyond->second}});
      continue;
    }
    // The border of a flat body: half a turn of normals, over the one in its plane.
    const glm::dvec3 outward = glm::normalize(glm::cross(ends_m[1] - ends_m[0], normal));
    body.normals.push_back(outward);
    body.edges.push_back({ends_m, {normal, outward}});
    body.edges.push_back({ends_m, {outward, beyond->second}});
  }
}

/// Whether the planes of the edges' arcs each separate the ends of the other arc, or nearly so.
bool may_cross(const ConvexBody::Edge& a, const glm::dvec3& along_a, const ConvexBody::Edge& b,
               const glm::dvec3& along_b) {
  const auto are_apart = [](const std::array<glm::dvec3, 2>& normals, const glm::dvec3& along) {
    const double from = glm::dot(normals[0], along), to = glm::dot(normals[1], along);
    return from * to > 0.0 && std::min(std::abs(from), std::abs(to)) > arc_tolerance;
  };
  return !are_apart(a.normals, along_b) && !are_apart(b.normals, along_a);
}

/// A sphere around a part of a body: parts whose spheres are farther apart than a known distance need no
/// test.
struct PartSphere {
  glm::dvec3 center_m{0.0};
  double radius_m = 0.0;
  template <std::size_t count>
  explicit PartSphere(const std::array<glm::dvec3, count>& corners_m) {
    for (const glm::dvec3& p : corners_m)
      center_m += p / static_cast<double>(count);
    for (const glm::dvec3& p : corners_m)
      radius_m = std::max(radius_m, glm::distance(p, center_m));
  }
};

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

void offer_corners(const ConvexBody& of_corners, const ConvexBody& of_faces, bool swapped,
                   BodyDistance& best) {
  for (const ConvexBody::Face& face : of_faces.faces) {
    const PartSphere sphere(face.corners_m);
    for (const glm::dvec3& corner : of_corners.corners_m) {
      if (glm::distance(corner, sphere.center_m) - sphere.radius_m > best.distance_m) continue;
      const glm::dvec3 on_face = nearest_on_triangle(face.corners_m, corner).point;
      const double distance_m = glm::distance(corner, on_face);
      if (distance_m >= best.distance_m) continue;
      best = swapped ? BodyDistance{distance_m, on_face, corner} : BodyDistance{distance_m, corner, on_face};
    }
  }
}

}  // namespace

ConvexBody convex_body(const PosedEntity& entity, const glm::dvec3& origin_m) {
  const glm::dvec3 offset_m = entity.pose.p_world_m - origin_m;
  const glm::dvec3& scale = entity.state->row.scale;
  const auto placed = [&](const glm::dvec3& p_m) { return offset_m + entity.pose.q_world * (scale * p_m); };
  ConvexBody body;
  for (std::uint32_t i = 0; i < entity.mesh->triangle_count(); ++i) {
    const auto in_mesh = entity.mesh->corners(i);
    body.triangles_m.push_back({placed(in_mesh[0]), placed(in_mesh[1]), placed(in_mesh[2])});
  }
  const TriangleMesh hull = hull_of(*entity.mesh);
  for (const glm::vec3& p : hull.positions_m)
    body.corners_m.push_back(placed(glm::dvec3(p)));
  add_faces(body, hull, body.corners_m);
  put_extremes_first(body.corners_m);
  const glm::dvec3 minimum_m(entity.mesh->bounds().minimum_m), maximum_m(entity.mesh->bounds().maximum_m);
  body.diagonal_m = glm::length(scale * (maximum_m - minimum_m));
  const auto largest = [](const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); };
  const glm::dvec3 farthest_m = glm::max(glm::abs(minimum_m), glm::abs(maximum_m));
  body.ulp_m = std::max(ulp_m(largest(scale * farthest_m)), largest(scale) * ulp_m(largest(farthest_m)));
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
  const auto offer = [&](const glm::dvec3& axis) {
    const double gap_m = gap_along_m(first, second, axis, best.gap_m);
    if (gap_m > best.gap_m) best = {gap_m, axis};
  };
  for (const glm::dvec3& normal : first.normals)
    offer(-normal);
  for (const glm::dvec3& normal : second.normals)
    offer(normal);
  std::vector<glm::dvec3> along_second;
  for (const ConvexBody::Edge& edge : second.edges)
    along_second.push_back(glm::normalize(edge.ends_m[1] - edge.ends_m[0]));
  for (const ConvexBody::Edge& of_first : first.edges) {
    ConvexBody::Edge turned = of_first;  // the first body's normals in the difference
    for (glm::dvec3& normal : turned.normals)
      normal = -normal;
    const glm::dvec3 along_first = glm::normalize(of_first.ends_m[1] - of_first.ends_m[0]);
    for (std::size_t i = 0; i < second.edges.size(); ++i) {
      if (!may_cross(turned, along_first, second.edges[i], along_second[i])) continue;
      const glm::dvec3 across = glm::cross(along_first, along_second[i]);
      const double sine = glm::length(across);
      if (sine <= 1e-13) continue;
      const glm::dvec3 axis = across / sine;
      const double apart_m = glm::dot(axis, of_first.ends_m[0] - second.edges[i].ends_m[0]);
      if (std::abs(apart_m) < best.gap_m) continue;
      offer(axis);
      offer(-axis);
    }
  }
  return best;
}

BodyDistance surface_distance(const ConvexBody& first, const ConvexBody& second) {
  BodyDistance best;
  offer_corners(first, second, false, best);
  offer_corners(second, first, true, best);
  std::vector<PartSphere> of_second;
  for (const ConvexBody::Edge& edge : second.edges)
    of_second.emplace_back(edge.ends_m);
  for (const ConvexBody::Edge& edge : first.edges) {
    const PartSphere around(edge.ends_m);
    for (std::size_t i = 0; i < of_second.size(); ++i) {
      const double at_least_m =
          glm::distance(around.center_m, of_second[i].center_m) - around.radius_m - of_second[i].radius_m;
      if (at_least_m <= best.distance_m) offer_edges(edge.ends_m, second.edges[i].ends_m, best);
    }
  }
  return best;
}

double surface_distance_m(const ConvexBody& body, const glm::dvec3& point_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const ConvexBody::Face& face : body.faces)
    nearest_m =
        std::min(nearest_m, glm::distance(point_m, nearest_on_triangle(face.corners_m, point_m).point));
  return nearest_m;
}

double depth_inside_m(const ConvexBody& body, const glm::dvec3& point_m) {
  double depth_m = std::numeric_limits<double>::infinity();
  for (const ConvexBody::Face& face : body.faces)
    depth_m = std::min(depth_m, glm::dot(face.normal, face.corners_m[0] - point_m));
  return depth_m;
}

}  // namespace rtstdb::oracle
