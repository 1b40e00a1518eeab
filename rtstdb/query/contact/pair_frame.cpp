#include "rtstdb/query/contact/pair_frame.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <limits>

namespace rtstdb::query {
namespace {

glm::dvec3 hull_center_m(const PairBody& body) noexcept {
  return glm::dvec3(body.hull.hull->center_m) * body.row.scale;
}

double diagonal_m(const PairBody& body) noexcept {
  return 2.0 * glm::length(glm::dvec3(body.hull.hull->half_extent_m) * body.row.scale);
}

/// The triangle of a hull's face that contains the point, or comes nearest to it.
std::uint32_t triangle_at(const accel::GeometryPool::PooledHull& hull, std::uint32_t face,
                          const glm::dvec3& point_m) noexcept {
  const ConvexHull::Face& of_hull = hull.hull->faces[face];
  const auto triangles =
      std::span(hull.hull->face_triangles).subspan(of_hull.first_triangle, of_hull.triangle_count);
  std::uint32_t best = triangles.front();
  double best_inside = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t triangle : triangles) {
    const glm::uvec3& corners = hull.mesh->triangles[triangle];
    const glm::dvec3 a(hull.mesh->positions_m[corners.x]);
    const glm::dvec3 ab = glm::dvec3(hull.mesh->positions_m[corners.y]) - a;
    const glm::dvec3 ac = glm::dvec3(hull.mesh->positions_m[corners.z]) - a;
    const glm::dvec3 n = glm::cross(ab, ac);
    const double nn = glm::dot(n, n);
    if (nn == 0.0) continue;
    const double u = glm::dot(glm::cross(point_m - a, ac), n) / nn;
    const double v = glm::dot(glm::cross(ab, point_m - a), n) / nn;
    const double inside = std::min({u, v, 1.0 - u - v});
    if (inside <= best_inside) continue;
    best_inside = inside;
    best = triangle;
  }
  return best;
}

}  // namespace

PairFrame::PairFrame(const PairBody& first, const PairBody& second, WorldTime t) noexcept
    : first_hull(first.hull), second_hull(second.hull) {
  const Pose first_pose = pose_at(first.row.motion, t);
  const Pose second_pose = pose_at(second.row.motion, t);
  q_first = glm::quat(first_pose.q_world);
  q_second = glm::quat(second_pose.q_world);
  second_m = glm::vec3(second_pose.p_world_m - first_pose.p_world_m);
  second_center_m = glm::vec3(hull_center_m(second));
  first_scale = glm::vec3(first.row.scale);
  second_scale = glm::vec3(second.row.scale);
  v_relative_mps = glm::vec3(first.row.motion.v_world_mps - second.row.motion.v_world_mps);
  w_first_radps = glm::vec3(first.row.motion.w_world_radps);
  w_second_radps = glm::vec3(second.row.motion.w_world_radps);
}

ContactPoint PairFrame::contact_point(const glm::vec4& point, const glm::vec3& n_world,
                                      std::uint32_t first_face, std::uint32_t second_face) const noexcept {
  const glm::vec3 from_second_m = q_second * (second_center_m + glm::vec3(point));
  const glm::vec3 p_first_m = second_m + from_second_m;
  const float depth_m = point.w;
  const glm::vec3 half = 0.5f * depth_m * n_world;
  const glm::vec3 on_first = (glm::conjugate(q_first) * (p_first_m - half)) / first_scale;
  const glm::vec3 on_second = (glm::conjugate(q_second) * (from_second_m + half)) / second_scale;
  return {.p_first_m = p_first_m,
          .n_world = n_world,
          .depth_m = depth_m,
          .first_triangle = triangle_at(first_hull, first_face, glm::dvec3(on_first)),
          .second_triangle = triangle_at(second_hull, second_face, glm::dvec3(on_second)),
          .v_relative_mps = v_relative_mps + glm::cross(w_first_radps, p_first_m) -
                            glm::cross(w_second_radps, from_second_m)};
}

shared::PairRecord pair_record(const PairBody& first, const PairBody& second, WorldTime t, float margin_m,
                               bool is_named) noexcept {
  const Pose first_pose = pose_at(first.row.motion, t);
  const Pose second_pose = pose_at(second.row.motion, t);
  const glm::dquat to_second = glm::conjugate(second_pose.q_world);
  const glm::dquat q = to_second * first_pose.q_world;
  const glm::dvec3 apart_m = first_pose.p_world_m - second_pose.p_world_m +
                             first_pose.q_world * hull_center_m(first) -
                             second_pose.q_world * hull_center_m(second);
  const double first_m = diagonal_m(first);
  const double second_m = diagonal_m(second);
  return {.q = glm::vec4(static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z),
                         static_cast<float>(q.w)),
          .center_m = glm::vec3(to_second * apart_m),
          .first_hull = first.hull.texel,
          .first_scale = glm::vec3(first.row.scale),
          .second_hull = second.hull.texel,
          .second_scale = glm::vec3(second.row.scale),
          .margin_m = margin_m,
          .rounding_m = static_cast<float>(0.5 * std::max(first_m, second_m)) * 2.0f *
                        std::numeric_limits<float>::epsilon(),
          .size_m = static_cast<float>(std::min(first_m, second_m)),
          .limit_m = is_named ? std::numeric_limits<float>::max() : margin_m};
}

}  // namespace rtstdb::query
