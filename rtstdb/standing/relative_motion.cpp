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

PointOnBody point_on_body(const Motion& motion, const glm::dvec3& offset_m) noexcept {
  PointOnBody made{motion, offset_m};
  if (turns(motion)) return made;
  made.motion.p_world_m += motion.q_world * offset_m;
  made.offset_m = glm::dvec3(0.0);
  return made;
}

RelativeMotion::FrameTerms RelativeMotion::frame_terms(const Motion& body, const Motion& frame) noexcept {
  FrameTerms terms;
  terms.u = frame.w_world_radps;
  terms.v = body.v_world_mps - frame.v_world_mps;
  const glm::dmat3 w = cross_matrix(body.w_world_radps);
  const glm::dmat3 u = cross_matrix(terms.u);
  terms.k = w * w - 2.0 * u * w + u * u;
  terms.k_norm = norm(terms.k);
  terms.q = glm::mat3_cast(frame.q_world);
  const glm::dvec3 u_direction = direction(terms.u);
  terms.u_local = glm::transpose(terms.q) * u_direction;
  terms.k_along_u = glm::length(glm::transpose(terms.k) * u_direction);
  return terms;
}

RelativeMotion::RelativeMotion(const Motion& target, const Motion& observer) noexcept
    : target_(target),
      observer_(observer),
      v_(target.v_world_mps - observer.v_world_mps),
      turning_(target.w_world_radps - observer.w_world_radps),
      turning_radps_(glm::length(turning_)),
      target_terms_(frame_terms(target, observer)),
      observer_terms_(frame_terms(observer, target)),
      w_local_(observer_terms_.u_local),
      q_target_(observer_terms_.q) {}

RelativeMotion::View RelativeMotion::at(std::int64_t ns) const noexcept {
  const Pose target = pose_at(target_, world_time_ns(ns));
  const Pose observer = pose_at(observer_, world_time_ns(ns));
  View view;
  view.ns = ns;
  view.apart_m = target.p_world_m - observer.p_world_m;
  const glm::dmat3 to_observer = glm::transpose(glm::mat3_cast(observer.q_world));
  view.offset_m = to_observer * view.apart_m;
  view.rotation = to_observer * glm::mat3_cast(target.q_world);
  return view;
}

double RelativeMotion::acceleration_along(const FrameTerms& terms, const glm::dvec3& apart_a_m,
                                          const glm::dvec3& apart_b_m, const glm::dvec3& n,
                                          double lever_m) noexcept {
  // If the frame does not rotate, n is constant in the world and A is zero.
  if (terms.u == glm::dvec3(0.0)) return glm::length(glm::transpose(terms.k) * (terms.q * n)) * lever_m;
  // In the world n rotates about u: its component along u is constant, and A has no component along u.
  const double along = glm::dot(n, terms.u_local);
  const double across = glm::length(n - along * terms.u_local);
  const auto a = [&](const glm::dvec3& apart_m) {
    return -2.0 * glm::cross(terms.u, terms.v) + glm::cross(terms.u, glm::cross(terms.u, apart_m));
  };
  return std::abs(along) * terms.k_along_u * lever_m +
         across * (terms.k_norm * lever_m + larger_length(a(apart_a_m), a(apart_b_m)));
}

RelativeMotion::Bounds RelativeMotion::bounds(const FrameTerms& terms, double turning,
                                              const glm::dvec3& apart_a_m, const glm::dvec3& apart_b_m,
                                              double lever_m) noexcept {
  const auto a = [&](const glm::dvec3& apart_m) {
    return -2.0 * glm::cross(terms.u, terms.v) + glm::cross(terms.u, glm::cross(terms.u, apart_m));
  };
  const auto drift = [&](const glm::dvec3& apart_m) { return terms.v - glm::cross(terms.u, apart_m); };
  return {larger_length(drift(apart_a_m), drift(apart_b_m)) + turning * lever_m,
          terms.k_norm * lever_m + larger_length(a(apart_a_m), a(apart_b_m))};
}

RelativeMotion::Bounds RelativeMotion::target_bounds(const View& a, const View& b,
                                                     double lever_m) const noexcept {
  return bounds(target_terms_, turning_radps_, a.apart_m, b.apart_m, lever_m);
}
RelativeMotion::Bounds RelativeMotion::observer_bounds(const View& a, const View& b,
                                                       double lever_m) const noexcept {
  return bounds(observer_terms_, turning_radps_, -a.apart_m, -b.apart_m, lever_m);
}
double RelativeMotion::target_acceleration(const View& a, const View& b, const glm::dvec3& n,
                                           double lever_m) const noexcept {
  return acceleration_along(target_terms_, a.apart_m, b.apart_m, n, lever_m);
}
double RelativeMotion::observer_acceleration(const View& a, const View& b, const glm::dvec3& n,
                                             double lever_m) const noexcept {
  return acceleration_along(observer_terms_, -a.apart_m, -b.apart_m, n, lever_m);
}

RelativeMotion::DirectionBounds RelativeMotion::direction_bounds(const glm::dvec3& e) const noexcept {
  const glm::dmat3& k = target_terms_.k;
  if (target_.w_world_radps == glm::dvec3(0.0)) {
    const glm::dvec3 e_world = q_target_ * e;
    return {glm::length(glm::cross(turning_, e_world)), glm::length(k * e_world)};
  }
  // In the world e rotates about w: the lengths of its components along and across w are constant.
  const double along = glm::dot(e, w_local_);
  const double across = glm::length(e - along * w_local_);
  const glm::dvec3 w_world = direction(target_.w_world_radps);
  return {std::abs(along) * glm::length(glm::cross(turning_, w_world)) + across * turning_radps_,
          std::abs(along) * glm::length(k * w_world) + across * target_terms_.k_norm};
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
  return known_to_m + units * (magnitude_m(target_) + magnitude_m(observer_));
}

}  // namespace rtstdb::standing
