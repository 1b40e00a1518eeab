#include "rtstdb/query/contact/pair_frame.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/ulp.hpp"
#include "rtstdb/query/remainder.hpp"

namespace rtstdb::query {
namespace {

glm::dvec3 hull_center_m(const PairBody& body) noexcept {
  return glm::dvec3(body.hull.hull->center_m) * body.row.scale;
}

double diagonal_m(const PairBody& body) noexcept {
  return 2.0 * glm::length(glm::dvec3(body.hull.hull->half_extent_m) * body.row.scale);
}

/// Upper bound of the distance of the body's omitted corners from its hull.
double omitted_m(const PairBody& body) noexcept {
  const glm::dvec3& scale = body.row.scale;
  return static_cast<double>(body.hull.hull->max_omitted_m) * std::max({scale.x, scale.y, scale.z});
}

/// Half a unit in the last place of single precision, relative to a value.
constexpr double half_unit = 0.5 * static_cast<double>(std::numeric_limits<float>::epsilon());

double largest_coordinate_m(const PairBody& body) noexcept {
  const glm::dvec3 largest_m =
      (glm::abs(glm::dvec3(body.hull.hull->center_m)) + glm::dvec3(body.hull.hull->half_extent_m)) *
      body.row.scale;
  return std::max({largest_m.x, largest_m.y, largest_m.z});
}

/// A triangle of a hull's mesh, and a point near its plane.
struct PointOnTriangle {
  double inside = 0.0;     ///< least barycentric weight of the point's foot: not below 0 in the triangle
  double square_m2 = 0.0;  ///< squared distance of the point

  PointOnTriangle(const TriangleMesh& mesh, std::uint32_t triangle, const glm::dvec3& point_m) noexcept {
    const glm::uvec3& corners = mesh.triangles[triangle];
    const glm::dvec3 a(mesh.positions_m[corners.x]);
    const glm::dvec3 b(mesh.positions_m[corners.y]);
    const glm::dvec3 c(mesh.positions_m[corners.z]);
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double nn = std::max(glm::dot(n, n), std::numeric_limits<double>::min());
    const double u = glm::dot(glm::cross(point_m - a, c - a), n) / nn;
    const double v = glm::dot(glm::cross(b - a, point_m - a), n) / nn;
    inside = std::min({u, v, 1.0 - u - v});
    const double height_m = glm::dot(point_m - a, n);
    square_m2 = inside >= 0.0
                    ? height_m * height_m / nn
                    : std::min({to_edge(a, b, point_m), to_edge(b, c, point_m), to_edge(c, a, point_m)});
  }

 private:
  static double to_edge(const glm::dvec3& from, const glm::dvec3& to, const glm::dvec3& point_m) noexcept {
    const glm::dvec3 edge = to - from;
    const double along =
        glm::dot(point_m - from, edge) / std::max(glm::dot(edge, edge), std::numeric_limits<double>::min());
    const glm::dvec3 off = point_m - from - std::clamp(along, 0.0, 1.0) * edge;
    return glm::dot(off, off);
  }
};

/// The triangle at the point: of the face, or, where that does not reach the point, the nearest of all.
std::uint32_t triangle_at(const accel::GeometryPool::PooledHull& hull, std::uint32_t face,
                          const glm::dvec3& point_m) noexcept {
  constexpr double outside = -0.01;  // in barycentric weights: farther than rounding explains
  const std::span all(hull.hull->face_triangles);
  // A solid's curved surface is not among its faces, and its faces have no triangles.
  const bool has_face = face < hull.hull->faces.size();
  const ConvexHull::Face of_hull = has_face ? hull.hull->faces[face] : ConvexHull::Face{};
  std::uint32_t best = all[of_hull.first_triangle];
  double best_inside = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t triangle : all.subspan(of_hull.first_triangle, of_hull.triangle_count)) {
    const double inside = PointOnTriangle(*hull.mesh, triangle, point_m).inside;
    if (inside <= best_inside) continue;
    best_inside = inside;
    best = triangle;
  }
  if (best_inside >= outside) return best;
  return *std::ranges::min_element(all, {}, [&](std::uint32_t triangle) {
    return PointOnTriangle(*hull.mesh, triangle, point_m).square_m2;
  });
}

}  // namespace

BodyPoses::BodyPoses(const EntityRow& first, const EntityRow& second, WorldTime t) noexcept {
  const Pose first_pose = pose_at(first.motion, t);
  const Pose second_pose = pose_at(second.motion, t);
  q_first = first_pose.q_world;
  q_second = second_pose.q_world;
  second_m = second_pose.p_world_m - first_pose.p_world_m;
  v_relative_mps = first.motion.v_world_mps - second.motion.v_world_mps;
  w_first_radps = first.motion.w_world_radps;
  w_second_radps = second.motion.w_world_radps;
}

glm::vec3 BodyPoses::v_relative_at_mps(const glm::dvec3& p_first_m) const noexcept {
  return glm::vec3(v_relative_mps + glm::cross(w_first_radps, p_first_m) -
                   glm::cross(w_second_radps, p_first_m - second_m));
}

PairFrame::PairFrame(const PairBody& first, const PairBody& second, WorldTime t) noexcept
    : BodyPoses(first.row, second.row, t),
      second_center_m(hull_center_m(second)),
      first_scale(first.row.scale),
      second_scale(second.row.scale),
      first_hull(first.hull),
      second_hull(second.hull) {}

ContactPoint PairFrame::contact_point(const glm::vec4& point, const glm::vec3& n_world,
                                      std::uint32_t first_face, std::uint32_t second_face) const noexcept {
  const glm::dvec3 p_first_m = from_first(glm::vec3(point));
  const float depth_m = point.w;
  const glm::dvec3 half_m = 0.5 * static_cast<double>(depth_m) * glm::dvec3(n_world);
  const glm::dvec3 on_first_m = (glm::conjugate(q_first) * (p_first_m - half_m)) / first_scale;
  const glm::dvec3 on_second_m = (glm::conjugate(q_second) * (p_first_m - second_m + half_m)) / second_scale;
  return {.p_first_m = glm::vec3(p_first_m),
          .n_world = n_world,
          .depth_m = depth_m,
          .first_triangle = triangle_at(first_hull, first_face, on_first_m),
          .second_triangle = triangle_at(second_hull, second_face, on_second_m),
          .v_relative_mps = v_relative_at_mps(p_first_m)};
}

shared::PairRecord pair_record(const PairBody& first, const PairBody& second, WorldTime t, float margin_m,
                               bool is_named) noexcept {
  const Pose first_pose = pose_at(first.row.motion, t);
  const Pose second_pose = pose_at(second.row.motion, t);
  const glm::dquat to_second = glm::conjugate(second_pose.q_world);
  const glm::dquat q_second = to_second * first_pose.q_world;
  const glm::dvec4 q(q_second.x, q_second.y, q_second.z, q_second.w);
  const glm::dvec3 center_m =
      to_second * (first_pose.p_world_m - second_pose.p_world_m + first_pose.q_world * hull_center_m(first) -
                   second_pose.q_world * hull_center_m(second));
  const double first_m = diagonal_m(first);
  const double second_m = diagonal_m(second);
  const double between_m = glm::length(center_m);
  // Upper bound: rotating a point of the first body makes 12 roundings of half a unit, and its scale, the
  // sum with the centre and the product with a direction the rest.
  const double rounding_m = half_unit * (12.0 * first_m + 4.0 * second_m + 8.0 * between_m);
  const double precision_m =
      std::max({contact_precision * std::min(first_m, second_m),
                8.0 * ulp_m(largest_coordinate_m(first_m >= second_m ? first : second)),
                16.0 * half_unit * (between_m - 0.5 * (first_m + second_m))});
  return {.q = glm::vec4(q),
          .q_low = remainder_of(q),
          .center_m = glm::vec3(center_m),
          .first_hull = first.hull.texel,
          .center_low_m = remainder_of(center_m),
          .second_hull = second.hull.texel,
          .first_scale = glm::vec3(first.row.scale),
          .margin_m = margin_m,
          .first_scale_low = remainder_of(first.row.scale),
          .limit_m = is_named ? std::numeric_limits<float>::max() : margin_m,
          .second_scale = glm::vec3(second.row.scale),
          .rounding_m = static_cast<float>(rounding_m),
          .second_scale_low = remainder_of(second.row.scale),
          .precision_m = static_cast<float>(precision_m),
          .omitted_m = static_cast<float>(omitted_m(first) + omitted_m(second))};
}

}  // namespace rtstdb::query
