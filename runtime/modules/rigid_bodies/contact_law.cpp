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

/// What the springs along and across the normals give, for a stiffness of 1 N/m of each point, when the bodies
/// move with the points' velocities.
struct SpringPower {
  double normal = 0.0, across = 0.0;
};

SpringPower power_of(std::span<const FrozenContact> points) {
  SpringPower power;
  for (const FrozenContact& point : points) {
    if (point.depth_m <= 0.0) continue;
    power.normal += point.depth_m * point.depth_m * glm::dot(point.normal, point.velocity_mps);
    power.across -= point.depth_m * glm::dot(point.stretch_m, point.velocity_mps);
  }
  return power;
}

/// Moves from `damped_j` what the springs lack of the energy of the law.
void fill(double& stored_j, double law_j, double& damped_j) {
  const double filled_j = std::clamp(law_j - stored_j, 0.0, damped_j);
  stored_j += filled_j;
  damped_j -= filled_j;
}

/// The share of the law's force that springs with this energy have.
double factor_of(double stored_j, double law_j, double power) {
  const double held = law_j > 0.0 ? std::max(0.0, stored_j / law_j) : stored_j < 0.0 ? 0.0 : 1.0;
  return power > 0.0 ? held : std::max(1.0, held);
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

SpringEnergy law_energy(std::span<const FrozenContact> points, const ContactLaw& law) noexcept {
  SpringEnergy energy;
  const double sum_m = depth_sum_m(points);
  for (const FrozenContact& point : points) {
    if (point.depth_m <= 0.0) continue;
    const double half_stiffness = 0.5 * law.stiffness_npm * (point.depth_m / sum_m);
    energy.normal_j += half_stiffness * point.depth_m * point.depth_m;
    energy.across_j += half_stiffness * glm::dot(point.stretch_m, point.stretch_m);
  }
  return energy;
}

void press(std::span<FrozenContact> points, const ContactLaw& law, const SpringEnergy& begin, double decay,
           StoredEnergy& stored) noexcept {
  SpringEnergy& springs = stored.springs;
  stored.damped_j = std::min(stored.damped_j, begin.normal_j + begin.across_j);
  fill(springs.normal_j, begin.normal_j, stored.damped_j);
  fill(springs.across_j, begin.across_j, stored.damped_j);
  springs.normal_j = std::min(springs.normal_j, max_stiffening * begin.normal_j);
  if (springs.normal_j > begin.normal_j) springs.normal_j -= decay * (springs.normal_j - begin.normal_j);
  springs.across_j = std::min(springs.across_j, begin.across_j);

  const SpringPower power = power_of(points);
  const double normal_factor = factor_of(springs.normal_j, begin.normal_j, power.normal);
  const double across_factor = factor_of(springs.across_j, begin.across_j, power.across);
  const double sum_m = depth_sum_m(points);
  for (FrozenContact& point : points) {
    point.normal_n = point.across_n = point.damping_n = glm::dvec3(0.0);
    const double share = point.depth_m > 0.0 ? point.depth_m / sum_m : 0.0;
    const double stiffness = share * law.stiffness_npm, damping = share * law.damping_nspm;
    const double spring_n = normal_factor * stiffness * point.depth_m;
    const double pressed_n =
        share == 0.0 ? 0.0 : std::max(0.0, spring_n - damping * glm::dot(point.velocity_mps, point.normal));
    if (pressed_n == 0.0) {
      point.stretch_m = glm::dvec3(0.0);
      continue;
    }
    const double max_across_n = law.friction * pressed_n;
    point.stretch_m = limited(point.stretch_m, max_across_n / stiffness);
    point.normal_n = spring_n * point.normal;
    point.across_n = -across_factor * stiffness * point.stretch_m;
    const glm::dvec3 whole_across_n =
        limited(point.across_n - damping * across(point.velocity_mps, point.normal), max_across_n);
    point.damping_n = (pressed_n - spring_n) * point.normal + whole_across_n - point.across_n;
  }
}

void store_work(FrozenContact& contact, const glm::dvec3& after_mps, double dt_s,
                StoredEnergy& stored) noexcept {
  const glm::dvec3 way_m = 0.5 * dt_s * (contact.velocity_mps + after_mps);
  stored.springs.normal_j -= glm::dot(contact.normal_n, way_m);
  stored.springs.across_j -= glm::dot(contact.across_n, way_m);
  stored.damped_j -= glm::dot(contact.damping_n, way_m);
  contact.velocity_mps = after_mps;
}

}  // namespace hil::modules
