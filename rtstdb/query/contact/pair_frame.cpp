#include "rtstdb/query/contact/pair_frame.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <limits>
#include <span>

namespace rtstdb::query {
namespace {

glm::dvec3 hull_center_m(const PairBody& body) noexcept {
  return glm::dvec3(body.hull.hull->center_m) * body.row.scale;
}

double diagonal_m(const PairBody& body) noexcept {
  return 2.0 * glm::length(glm::dvec3(body.hull.hull->half_extent_m) * body.row.scale);
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
  q_first = glm::quat(first_pose.q_world);
  q_second = glm::quat(second_pose.q_world);
  second_m = glm::vec3(second_pose.p_world_m - first_pose.p_world_m);
  v_relative_mps = glm::vec3(first.motion.v_world_mps - second.motion.v_world_mps);
  w_first_radps = glm::vec3(first.motion.w_world_radps);
  w_second_radps = glm::vec3(second.motion.w_world_radps);
}

glm::vec3 BodyPoses::v_relative_at_mps(const glm::vec3& p_first_m) const noexcept {
  return v_relative_mps + glm::cross(w_first_radps, p_first_m) -
         glm::cross(w_second_radps, p_first_m - second_m);
}

PairFrame::PairFrame(const PairBody& first, const PairBody& second, WorldTime t) noexcept
    : BodyPoses(first.row, second.row, t), first_hull(first.hull), second_hull(second.hull) {
  second_center_m = glm::vec3(hull_center_m(second));
  first_scale = glm::vec3(first.row.scale);
  second_scale = glm::vec3(second.row.scale);
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
          .v_relative_mps = v_relative_at_mps(p_first_m)};
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
