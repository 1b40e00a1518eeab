#include "runtime/modules/rigid_bodies/contact_law.hpp"

#include <glm/geometric.hpp>

#include <algorithm>

namespace hil::modules {
namespace {

glm::dvec3 across(const glm::dvec3& v, const glm::dvec3& normal) {
  return v - glm::dot(v, normal) * normal;
}

/// `v` with at most this length.
glm::dvec3 limited(const glm::dvec3& v, double max_length) {
  const double length = glm::length(v);
  return length > max_length ? v * (max_length / length) : v;
}

double depth_sum_m(std::span<const FrozenContact> points) {
  double sum_m = 0.0;
  for (const FrozenContact& point : points)
    sum_m += std::max(0.0, point.depth_m);
  return sum_m;
}

/// What the springs give when they press by the law and the bodies move with the points' velocities.
double released_w(std::span<const FrozenContact> points, double stiffness_per_m) {
  double power_w = 0.0;
  for (const FrozenContact& point : points) {
    if (point.depth_m <= 0.0) continue;
    const double stiffness = stiffness_per_m * point.depth_m;
    power_w +=
        stiffness * glm::dot(point.depth_m * point.normal - point.stretch_m, point.velocity_mps);
  }
  return power_w;
}

}  // namespace

glm::dvec3 place_of(const FrozenContact& contact, const BodyMotion& first,
                    const BodyMotion& second) noexcept {
  return contact.first_weight * (first.p_m + contact.first_arm_m) +
         (1.0 - contact.first_weight) * (second.p_m + contact.second_arm_m);
}

glm::dvec3 relative_velocity(const glm::dvec3& place_m, const BodyMotion& first,
                             const BodyMotion& second) noexcept {
  return first.v_mps + glm::cross(first.w_radps, place_m - first.p_m) - second.v_mps -
         glm::cross(second.w_radps, place_m - second.p_m);
}

void follow(FrozenContact& contact, double dt_s) noexcept {
  contact.depth_m -= dt_s * glm::dot(contact.velocity_mps, contact.normal);
  contact.stretch_m += dt_s * across(contact.velocity_mps, contact.normal);
}

double law_energy_j(std::span<const FrozenContact> points, const ContactLaw& law) noexcept {
  const double sum_m = depth_sum_m(points);
  if (sum_m <= 0.0) return 0.0;
  double energy_j = 0.0;
  for (const FrozenContact& point : points) {
    if (point.depth_m <= 0.0) continue;
    const double squares = point.depth_m * point.depth_m + glm::dot(point.stretch_m, point.stretch_m);
    energy_j += 0.5 * law.stiffness_npm * (point.depth_m / sum_m) * squares;
  }
  return energy_j;
}

void press(std::span<FrozenContact> points, const ContactLaw& law, double begin_j, double decay,
           double& stored_j) noexcept {
  const double sum_m = depth_sum_m(points);
  // Energy is never stored where nothing presses; a deficit stays.
  stored_j = std::min(stored_j, max_stiffening * begin_j);
  if (stored_j > begin_j) stored_j -= decay * (stored_j - begin_j);
  double factor = begin_j > 0.0 ? std::max(0.0, stored_j / begin_j) : stored_j < 0.0 ? 0.0 : 1.0;
  if (sum_m > 0.0 && released_w(points, law.stiffness_npm / sum_m) <= 0.0) factor = std::max(1.0, factor);

  const double middle_j = law_energy_j(points, law);
  for (FrozenContact& point : points) {
    point.elastic_n = point.damping_n = glm::dvec3(0.0);
    const double share = point.depth_m > 0.0 ? point.depth_m / sum_m : 0.0;
    const double stiffness = factor * share * law.stiffness_npm, damping = share * law.damping_nspm;
    const double approach_mps = -glm::dot(point.velocity_mps, point.normal);
    const double pressed_n = std::max(0.0, stiffness * point.depth_m + damping * approach_mps);
    if (share == 0.0 || pressed_n == 0.0) {
      point.stretch_m = glm::dvec3(0.0);
      continue;
    }
    const double max_across_n = law.friction * pressed_n;
    if (stiffness > 0.0) point.stretch_m = limited(point.stretch_m, max_across_n / stiffness);
    const glm::dvec3 elastic_across_n = -stiffness * point.stretch_m;
    const glm::dvec3 across_n =
        limited(elastic_across_n - damping * across(point.velocity_mps, point.normal), max_across_n);
    point.elastic_n = stiffness * point.depth_m * point.normal + elastic_across_n;
    point.damping_n = pressed_n * point.normal + across_n - point.elastic_n;
  }
  if (stored_j > 0.0 && middle_j > 0.0) stored_j *= law_energy_j(points, law) / middle_j;
}

void store_work(FrozenContact& contact, const glm::dvec3& after_mps, double dt_s,
                double& stored_j) noexcept {
  const glm::dvec3 way_m = 0.5 * dt_s * (contact.velocity_mps + after_mps);
  stored_j -= glm::dot(contact.elastic_n, way_m);
  stored_j -= std::max(0.0, glm::dot(contact.damping_n, way_m));
  contact.velocity_mps = after_mps;
}

}  // namespace hil::modules
