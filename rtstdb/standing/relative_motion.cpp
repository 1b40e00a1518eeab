#include "rtstdb/standing/relative_motion.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace rtstdb::standing {
namespace {

/// [x], the matrix of the cross product with x.
glm::dmat3 cross_matrix(const glm::dvec3& x) noexcept {
  return {0.0, x.z, -x.y, -x.z, 0.0, x.x, x.y, -x.x, 0.0};
}

double norm(const glm::dmat3& m) noexcept {
  return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

glm::dvec3 direction(const glm::dvec3& x) noexcept {
  const double length = glm::length(x);
  return length > 0.0 ? x / length : glm::dvec3(0.0);
}

double larger_length(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  return std::sqrt(std::max(glm::dot(a, a), glm::dot(b, b)));
}

bool turns(const Motion& motion) noexcept {
  return motion.w_world_radps != glm::dvec3(0.0);
}

}  // namespace

Carried carried(const Motion& motion, const glm::dvec3& offset_m) noexcept {
  Carried made{motion, offset_m};
  if (turns(motion)) return made;
  made.motion.p_world_m += motion.q_world * offset_m;
  made.offset_m = glm::dvec3(0.0);
  return made;
}

RelativeMotion::Side RelativeMotion::side_of(const Motion& seen, const Motion& from) noexcept {
  Side side;
  side.u = from.w_world_radps;
  side.v = seen.v_world_mps - from.v_world_mps;
  const glm::dmat3 w = cross_matrix(seen.w_world_radps);
  const glm::dmat3 u = cross_matrix(side.u);
  side.k = w * w - 2.0 * u * w + u * u;
  side.k_norm = norm(side.k);
  side.q = glm::mat3_cast(from.q_world);
  const glm::dvec3 u_direction = direction(side.u);
  side.u_local = glm::transpose(side.q) * u_direction;
  side.k_along_u = glm::length(glm::transpose(side.k) * u_direction);
  return side;
}

RelativeMotion::RelativeMotion(const Motion& of, const Motion& from) noexcept
    : of_(of),
      from_(from),
      v_(of.v_world_mps - from.v_world_mps),
      turning_(of.w_world_radps - from.w_world_radps),
      turning_radps_(glm::length(turning_)),
      seen_from_(side_of(of, from)),
      seen_of_(side_of(from, of)),
      w_local_(seen_of_.u_local),
      q_of_(seen_of_.q) {}

RelativeMotion::View RelativeMotion::at(std::int64_t ns) const noexcept {
  const Pose of = pose_at(of_, world_time_ns(ns));
  const Pose from = pose_at(from_, world_time_ns(ns));
  View view;
  view.ns = ns;
  view.apart_m = of.p_world_m - from.p_world_m;
  const glm::dmat3 to_from = glm::transpose(glm::mat3_cast(from.q_world));
  view.offset_m = to_from * view.apart_m;
  view.rotation = to_from * glm::mat3_cast(of.q_world);
  return view;
}

double RelativeMotion::bend(const Side& side, const glm::dvec3& apart_a_m, const glm::dvec3& apart_b_m,
                            const glm::dvec3& n, double lever_m) noexcept {
  // If the frame does not rotate, n is constant in the world and A is zero.
  if (side.u == glm::dvec3(0.0)) return glm::length(glm::transpose(side.k) * (side.q * n)) * lever_m;
  // In the world n rotates about u: its component along u is constant, and A has no component along u.
  const double along = glm::dot(n, side.u_local);
  const double across = glm::length(n - along * side.u_local);
  const auto a = [&](const glm::dvec3& apart_m) {
    return -2.0 * glm::cross(side.u, side.v) + glm::cross(side.u, glm::cross(side.u, apart_m));
  };
  return std::abs(along) * side.k_along_u * lever_m +
         across * (side.k_norm * lever_m + larger_length(a(apart_a_m), a(apart_b_m)));
}

RelativeMotion::Bounds RelativeMotion::bounds(const Side& side, double turning, const glm::dvec3& apart_a_m,
                                              const glm::dvec3& apart_b_m, double lever_m) noexcept {
  const auto a = [&](const glm::dvec3& apart_m) {
    return -2.0 * glm::cross(side.u, side.v) + glm::cross(side.u, glm::cross(side.u, apart_m));
  };
  const auto drift = [&](const glm::dvec3& apart_m) { return side.v - glm::cross(side.u, apart_m); };
  return {larger_length(drift(apart_a_m), drift(apart_b_m)) + turning * lever_m,
          side.k_norm * lever_m + larger_length(a(apart_a_m), a(apart_b_m))};
}

RelativeMotion::Bounds RelativeMotion::of_seen(const View& a, const View& b, double lever_m) const noexcept {
  return bounds(seen_from_, turning_radps_, a.apart_m, b.apart_m, lever_m);
}
RelativeMotion::Bounds RelativeMotion::from_seen(const View& a, const View& b,
                                                 double lever_m) const noexcept {
  return bounds(seen_of_, turning_radps_, -a.apart_m, -b.apart_m, lever_m);
}
double RelativeMotion::of_bend(const View& a, const View& b, const glm::dvec3& n,
                               double lever_m) const noexcept {
  return bend(seen_from_, a.apart_m, b.apart_m, n, lever_m);
}
double RelativeMotion::from_bend(const View& a, const View& b, const glm::dvec3& n,
                                 double lever_m) const noexcept {
  return bend(seen_of_, -a.apart_m, -b.apart_m, n, lever_m);
}

RelativeMotion::Turn RelativeMotion::turn(const glm::dvec3& e) const noexcept {
  const glm::dmat3& k = seen_from_.k;
  if (of_.w_world_radps == glm::dvec3(0.0)) {
    const glm::dvec3 e_world = q_of_ * e;
    return {glm::length(glm::cross(turning_, e_world)), glm::length(k * e_world)};
  }
  // In the world e rotates about w: the lengths of its components along and across w are constant.
  const double along = glm::dot(e, w_local_);
  const double across = glm::length(e - along * w_local_);
  const glm::dvec3 w_world = direction(of_.w_world_radps);
  return {std::abs(along) * glm::length(glm::cross(turning_, w_world)) + across * turning_radps_,
          std::abs(along) * glm::length(k * w_world) + across * seen_from_.k_norm};
}

double RelativeMotion::noise_m(std::int64_t first_ns, std::int64_t last_ns, double lever_m) const noexcept {
  constexpr double known_to_m = 1e-9;
  constexpr double units = 64.0 * std::numeric_limits<double>::epsilon();
  const auto magnitude_m = [&](const Motion& motion) {
    const double far_s = std::max(std::abs(seconds_between(motion.valid_from, world_time_ns(first_ns))),
                                  std::abs(seconds_between(motion.valid_from, world_time_ns(last_ns))));
    return glm::length(motion.p_world_m) + glm::length(motion.v_world_mps) * far_s +
           lever_m * (1.0 + glm::length(motion.w_world_radps) * far_s);
  };
  return known_to_m + units * (magnitude_m(of_) + magnitude_m(from_));
}

}  // namespace rtstdb::standing
