#include "rtstdb/geometry/motion_bounds.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <rtstdb/result.hpp>

namespace rtstdb {
namespace {

/// Bound on what rounding can add to a coordinate computed by pose_at and the formulas here.
double rounding_pad_m(const Motion& motion, double rho_m, double dt0_s, double dt1_s) noexcept {
  const double far_s = std::max(std::abs(dt0_s), std::abs(dt1_s));
  const double path_m = glm::length(motion.p_world_m) + glm::length(motion.v_world_mps) * far_s;
  const double turned_rad = glm::length(motion.w_world_radps) * far_s;
  constexpr double units = 16.0 * std::numeric_limits<double>::epsilon();
  return units * (path_m + rho_m * (1.0 + turned_rad));
}

}  // namespace

OrientedBox oriented_box(const Bounds& bounds, const glm::dvec3& scale, const Pose& pose) noexcept {
  const glm::dvec3 minimum_m(bounds.minimum_m);
  const glm::dvec3 maximum_m(bounds.maximum_m);
  const glm::dmat3 rotation = glm::mat3_cast(pose.q_world);
  return {pose.p_world_m + rotation * (scale * 0.5 * (minimum_m + maximum_m)),
          {rotation[0], rotation[1], rotation[2]},
          scale * 0.5 * (maximum_m - minimum_m)};
}

WorldBox box_around(const OrientedBox& box) noexcept {
  const glm::dvec3 half_m = glm::abs(box.axis[0]) * box.half_extent_m.x +
                            glm::abs(box.axis[1]) * box.half_extent_m.y +
                            glm::abs(box.axis[2]) * box.half_extent_m.z;
  return {box.center_m - half_m, box.center_m + half_m};
}

double reach_m(const Bounds& bounds, const glm::dvec3& scale) noexcept {
  const glm::dvec3 farthest_m =
      glm::max(glm::abs(glm::dvec3(bounds.minimum_m)), glm::abs(glm::dvec3(bounds.maximum_m)));
  return glm::length(scale * farthest_m);
}

WorldBox motion_bounds(const Bounds& bounds, const glm::dvec3& scale, const Motion& motion, WorldTime t0,
                       WorldTime t1) noexcept {
  RTSTDB_ASSERT(t0 <= t1, "the interval of time ends before it begins");
  const Pose first = pose_at(motion, t0);
  const Pose last = pose_at(motion, t1);
  const WorldBox first_box = box_around(oriented_box(bounds, scale, first));
  const WorldBox last_box = box_around(oriented_box(bounds, scale, last));
  const double rho_m = reach_m(bounds, scale);
  const double window_s = seconds_between(t0, t1);

  const glm::dvec3 w2 = motion.w_world_radps * motion.w_world_radps;
  const glm::dvec3 square_part(std::sqrt(w2.y + w2.z), std::sqrt(w2.z + w2.x), std::sqrt(w2.x + w2.y));
  const glm::dvec3 bulge_m =
      square_part * (rho_m * glm::length(motion.w_world_radps) * window_s * window_s / 8.0);

  const double pad_m = rounding_pad_m(motion, rho_m, seconds_between(motion.valid_from, t0),
                                      seconds_between(motion.valid_from, t1));
  const glm::dvec3 chord_minimum = glm::min(first_box.minimum_m, last_box.minimum_m) - bulge_m;
  const glm::dvec3 chord_maximum = glm::max(first_box.maximum_m, last_box.maximum_m) + bulge_m;
  const glm::dvec3 ball_minimum = glm::min(first.p_world_m, last.p_world_m) - rho_m;
  const glm::dvec3 ball_maximum = glm::max(first.p_world_m, last.p_world_m) + rho_m;
  return {glm::max(chord_minimum, ball_minimum) - pad_m, glm::min(chord_maximum, ball_maximum) + pad_m};
}

}  // namespace rtstdb
