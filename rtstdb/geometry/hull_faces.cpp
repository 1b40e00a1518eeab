#include "rtstdb/geometry/hull_faces.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

namespace rtstdb {
namespace {

class FaceMaker {
 public:
  FaceMaker(const HullTriangles& hull, std::span<const glm::vec3> points_m, double flatness_m)
      : hull_(hull),
        points_m_(points_m),
        flatness_m_(flatness_m),
        beside_(neighbors_of(hull.triangles)),
        next_(points_m.size()),
        previous_(points_m.size()),
        number_(points_m.size(), no_index),
        in_face_(points_m.size(), no_index) {
    faces_.of_triangle.assign(hull.triangles.size(), no_index);
  }

  HullFaces make() && {
    for (const std::uint32_t corner : hull_.corners) {
      number_[corner] = static_cast<std::uint32_t>(faces_.hull.corners_m.size());
      faces_.hull.corners_m.push_back(points_m_[corner]);
    }
    std::vector<std::uint32_t> by_area(hull_.triangles.size());
    std::iota(by_area.begin(), by_area.end(), 0u);
    std::ranges::stable_sort(by_area, [&](std::uint32_t a, std::uint32_t b) {
      return hull_.planes[a].area_m2() > hull_.planes[b].area_m2();
    });
    for (const std::uint32_t seed : by_area)
      if (faces_.of_triangle[seed] == no_index) add_face(seed);
    return std::move(faces_);
  }

 private:
  /// An edge of the polygon's border, with the triangle inside.
  struct Edge {
    std::uint32_t from, to, triangle;
    int side;  // of the triangle
  };

  glm::dvec3 at(std::uint32_t corner) const { return glm::dvec3(points_m_[corner]); }

  void link(std::uint32_t from, std::uint32_t to) {
    next_[from] = to;
    previous_[to] = from;
  }

  bool turns_left(std::uint32_t a, std::uint32_t b, std::uint32_t c, const glm::dvec3& normal) const {
    return glm::dot(glm::cross(at(b) - at(a), at(c) - at(b)), normal) >= 0.0;
  }

  /// Whether the polygon remains convex with the corner of the triangle beyond its edge.
  bool may_add(const Edge& edge, std::uint32_t triangle, std::uint32_t corner, std::uint32_t face,
               const OrientedPlane& plane) const {
    if (faces_.of_triangle[triangle] != no_index || in_face_[corner] == face) return false;
    if (glm::dot(hull_.planes[triangle].normal(), plane.normal()) <= 0.0) return false;
    if (std::abs(plane.height_m(at(corner))) > flatness_m_) return false;
    return turns_left(previous_[edge.from], edge.from, corner, plane.normal()) &&
           turns_left(corner, edge.to, next_[edge.to], plane.normal()) &&
           turns_left(edge.from, corner, edge.to, plane.normal());
  }

  void add_face(std::uint32_t seed) {
    const auto face = static_cast<std::uint32_t>(faces_.hull.faces.size());
    const OrientedPlane& plane = hull_.planes[seed];
    std::vector<Edge> open;
    const glm::uvec3& first = hull_.triangles[seed];
    for (int i = 0; i < 3; ++i) {
      link(first[i], first[(i + 1) % 3]);
      in_face_[first[i]] = face;
      open.push_back({first[i], first[(i + 1) % 3], seed, i});
    }
    faces_.of_triangle[seed] = face;
    glm::dvec3 area = plane.area_m2() * plane.normal();
    std::uint32_t count = 3;
    while (!open.empty()) {
      const Edge edge = open.back();
      open.pop_back();
      const std::uint32_t other = beside_[edge.triangle][static_cast<std::size_t>(edge.side)];
      const glm::uvec3& t = hull_.triangles[other];
      const int side = t.x == edge.to ? 0 : t.y == edge.to ? 1 : 2;
      const std::uint32_t corner = t[(side + 2) % 3];
      if (!may_add(edge, other, corner, face, plane)) continue;
      faces_.of_triangle[other] = face;
      in_face_[corner] = face;
      link(edge.from, corner);
      link(corner, edge.to);
      ++count;
      area += hull_.planes[other].area_m2() * hull_.planes[other].normal();
      open.push_back({edge.from, corner, other, (side + 1) % 3});
      open.push_back({corner, edge.to, other, (side + 2) % 3});
    }
    ConvexHull& hull = faces_.hull;
    hull.faces.push_back({.normal = glm::vec3(glm::normalize(area)),
                          .first_corner = static_cast<std::uint32_t>(hull.face_corners.size()),
                          .corner_count = count});
    for (std::uint32_t i = 0, corner = first.x; i < count; ++i, corner = next_[corner])
      hull.face_corners.push_back(number_[corner]);
  }

  const HullTriangles& hull_;
  std::span<const glm::vec3> points_m_;
  double flatness_m_;
  std::vector<std::array<std::uint32_t, 3>> beside_;
  // For each point: its neighbours on the border of the current polygon, its number in the hull, and the last
  // face of which it was a corner.
  std::vector<std::uint32_t> next_, previous_, number_, in_face_;
  HullFaces faces_;
};

}  // namespace

HullFaces hull_faces(const HullTriangles& hull, std::span<const glm::vec3> points_m, double flatness_m) {
  return FaceMaker(hull, points_m, flatness_m).make();
}

void set_box(ConvexHull& hull, std::span<const glm::vec3> points_m) {
  glm::dvec3 minimum(std::numeric_limits<double>::infinity());
  glm::dvec3 maximum = -minimum;
  for (const glm::vec3& p_m : points_m) {
    minimum = glm::min(minimum, glm::dvec3(p_m));
    maximum = glm::max(maximum, glm::dvec3(p_m));
  }
  hull.center_m = glm::vec3(0.5 * (minimum + maximum));
  hull.half_extent_m = glm::vec3(0.5 * (maximum - minimum));
}

}  // namespace rtstdb
