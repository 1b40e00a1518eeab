#include "rtstdb/query/contact/pair_frame.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/mesh_surface.hpp"
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

/// Ulp of the body: at its largest scaled coordinate, or that of its hull times the scale, which may be twice
/// as large.
double ulp_of_m(const PairBody& body) noexcept {
  const auto largest = [](const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); };
  const glm::dvec3& scale = body.row.scale;
  const glm::dvec3 farthest_m =
      glm::abs(glm::dvec3(body.hull.hull->center_m)) + glm::dvec3(body.hull.hull->half_extent_m);
  return std::max(ulp_m(largest(scale * farthest_m)), largest(scale) * ulp_m(largest(farthest_m)));
}

/// The triangle at the point: the nearest of the face, or, where that is farther than `precision_m`, the
/// nearest of all.
std::uint32_t triangle_at(const accel::GeometryPool::PooledHull& hull, const glm::dvec3& scale,
                          std::uint32_t face, const glm::dvec3& point_m, double precision_m) noexcept {
  const std::span all(hull.hull->face_triangles);
  std::uint32_t best = all.front();
  double min_distance_m = std::numeric_limits<double>::max();
  const auto search = [&](std::span<const std::uint32_t> triangles) {
    for (const std::uint32_t triangle : triangles) {
      Corners corners = corners_of(*hull.mesh, triangle);
      for (glm::dvec3& corner_m : corners)
        corner_m *= scale;
      const double distance_m = distance_to_triangle_m(corners, point_m);
      if (distance_m >= min_distance_m) continue;
      min_distance_m = distance_m;
      best = triangle;
    }
  };
  // A solid's curved surface is not among its faces, and its faces have no triangles.
  if (face < hull.hull->faces.size()) {
    const ConvexHull::Face& of_hull = hull.hull->faces[face];
    search(all.subspan(of_hull.first_triangle, of_hull.triangle_count));
  }
  if (min_distance_m > precision_m) search(all);
  return best;
}

/// The width of the bounds of convex bodies whose centres are `between_m` apart.
double precision_of_m(const PairBody& first, const PairBody& second, double between_m) noexcept {
  const double first_m = diagonal_m(first);
  const double second_m = diagonal_m(second);
  return std::max({contact_precision * std::min(first_m, second_m),
                   8.0 * ulp_of_m(first_m >= second_m ? first : second),
                   16.0 * half_unit * (between_m - 0.5 * (first_m + second_m))});
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
      second_hull(second.hull),
      precision_m(precision_of_m(
          first, second, glm::length(from_first(glm::vec3(0.0f)) - q_first * hull_center_m(first)))) {}

ContactPoint PairFrame::contact_point(const glm::vec4& point, const glm::vec3& n_world,
                                      std::uint32_t first_face, std::uint32_t second_face) const noexcept {
  const glm::vec3 p_m(from_first(glm::vec3(point)));
  const glm::dvec3 p_first_m(p_m);  // rounded, so that the triangles are at the point that the answer has
  const float depth_m = point.w;
  const glm::dvec3 half_m = 0.5 * static_cast<double>(depth_m) * glm::dvec3(n_world);
  const glm::dvec3 on_first_m = glm::conjugate(q_first) * (p_first_m - half_m);
  const glm::dvec3 on_second_m = glm::conjugate(q_second) * (p_first_m - second_m + half_m);
  return {.p_first_m = p_m,
          .n_world = n_world,
          .depth_m = depth_m,
          .first_triangle = triangle_at(first_hull, first_scale, first_face, on_first_m, precision_m),
          .second_triangle = triangle_at(second_hull, second_scale, second_face, on_second_m, precision_m),
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
          .precision_m = static_cast<float>(precision_of_m(first, second, between_m)),
          .omitted_m = static_cast<float>(omitted_m(first) + omitted_m(second))};
}

}  // namespace rtstdb::query
