#include "runtime/modules/rigid_bodies/contact_law.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace hil::modules {
namespace {

glm::dvec3 tangential(const glm::dvec3& v, const glm::dvec3& normal) {
  return v - glm::dot(v, normal) * normal;
}

/// `v` with at most this length.
glm::dvec3 limited(const glm::dvec3& v, double max_length) {
  const double length = glm::length(v);
  return length > max_length ? v * (max_length / length) : v;
}

/// The mean depth of a point in a substep, at whose middle it is, while it is not below 0. With it the work
/// of a spring in the substep is the change of its energy, also where the contact begins or ends.
double mean_depth_m(const FrozenContact& point, double dt_s) {
  const double half_displacement_m = 0.5 * dt_s * std::abs(glm::dot(point.velocity_mps, point.normal));
  const double deepest_m = point.depth_m + half_displacement_m;
  if (point.depth_m >= half_displacement_m) return point.depth_m;
  return deepest_m > 0.0 ? 0.25 * deepest_m * deepest_m / half_displacement_m : 0.0;
}

/// Power that the normal and the friction springs supply to the bodies, for a stiffness of 1 N/m of each
/// point, when the bodies move with the points' velocities.
struct SpringPower {
  double normal = 0.0, tangential = 0.0;
};

SpringPower power_of(std::span<const FrozenContact> points) {
  SpringPower power;
  for (const FrozenContact& point : points) {
    power.normal += point.mean_depth_m * point.mean_depth_m * glm::dot(point.normal, point.velocity_mps);
    power.tangential -= point.mean_depth_m * glm::dot(point.stretch_m, point.velocity_mps);
  }
  return power;
}

/// Moves energy from `lost_j` to springs that store less than the law has.
void refill(double& stored_j, double law_j, double& lost_j) {
  const double filled_j = std::clamp(law_j - stored_j, 0.0, std::max(0.0, lost_j));
  stored_j += filled_j;
  lost_j -= filled_j;
}

/// The force of springs with this energy, divided by that of the law.
double force_factor(double stored_j, double law_j, double power) {
  const double stored_ratio = law_j > 0.0 ? std::max(0.0, stored_j / law_j) : stored_j < 0.0 ? 0.0 : 1.0;
  return power > 0.0 ? stored_ratio : std::max(1.0, stored_ratio);
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

void advance(FrozenContact& contact, double dt_s) noexcept {
  contact.depth_m -= dt_s * glm::dot(contact.velocity_mps, contact.normal);
  contact.stretch_m += dt_s * tangential(contact.velocity_mps, contact.normal);
}

SpringEnergy law_energy(std::span<const FrozenContact> points, const ContactLaw& law) noexcept {
  SpringEnergy energy;
  double sum_m = 0.0;
  for (const FrozenContact& point : points)
    sum_m += std::max(0.0, point.depth_m);
  for (const FrozenContact& point : points) {
    if (point.depth_m <= 0.0) continue;
    const double half_stiffness = 0.5 * law.stiffness_npm * (point.depth_m / sum_m);
    energy.normal_j += half_stiffness * point.depth_m * point.depth_m;
    energy.tangential_j += half_stiffness * glm::dot(point.stretch_m, point.stretch_m);
  }
  return energy;
}

void set_forces(std::span<FrozenContact> points, const ContactLaw& law, const SpringEnergy& begin,
                double dt_s, double decay_per_s, StoredEnergy& stored) noexcept {
  SpringEnergy& springs = stored.springs;
  const double surplus_j = std::max(0.0, springs.normal_j - begin.normal_j);
  const double decay = std::min(1.0, decay_per_s * dt_s);
  const double decayed_j = std::max(decay * surplus_j, surplus_j - (max_stiffening - 1.0) * begin.normal_j);
  const double slipped_j = std::max(0.0, springs.tangential_j - begin.tangential_j);
  springs.normal_j -= decayed_j;
  springs.tangential_j -= slipped_j;
  stored.lost_j = std::min(stored.lost_j + decayed_j + slipped_j, begin.normal_j + begin.tangential_j);
  refill(springs.normal_j, begin.normal_j, stored.lost_j);

  double sum_m = 0.0;
  for (FrozenContact& point : points) {
    point.mean_depth_m = mean_depth_m(point, dt_s);
    sum_m += point.mean_depth_m;
  }
  const SpringPower power = power_of(points);
  const double normal_factor = force_factor(springs.normal_j, begin.normal_j, power.normal);
  const double tangential_factor = force_factor(springs.tangential_j, begin.tangential_j, power.tangential);
  for (FrozenContact& point : points) {
    point.normal_force_n = point.tangential_force_n = point.damping_force_n = glm::dvec3(0.0);
    const double share = point.mean_depth_m > 0.0 ? point.mean_depth_m / sum_m : 0.0;
    const double stiffness = share * law.stiffness_npm, damping = share * law.damping_nspm;
    const double spring_force_n = normal_factor * stiffness * point.mean_depth_m;
    const double total_normal_n =
        share == 0.0 ? 0.0
                     : std::max(0.0, spring_force_n - damping * glm::dot(point.velocity_mps, point.normal));
    if (total_normal_n == 0.0) {
      point.stretch_m = glm::dvec3(0.0);
      continue;
    }
    const double max_tangential_n = law.friction * total_normal_n;
    point.stretch_m = limited(point.stretch_m, max_tangential_n / stiffness);
    point.normal_force_n = spring_force_n * point.normal;
    point.tangential_force_n = -tangential_factor * stiffness * point.stretch_m;
    const glm::dvec3 total_tangential_n = limited(
        point.tangential_force_n - damping * tangential(point.velocity_mps, point.normal), max_tangential_n);
    point.damping_force_n =
        (total_normal_n - spring_force_n) * point.normal + total_tangential_n - point.tangential_force_n;
  }
}

double max_force_share(std::span<const FrozenContact> points, std::span<const glm::dvec3> after_mps,
                       double dt_s, const StoredEnergy& stored) noexcept {
  // The work of a share of the forces is share * linear + share^2 * quadratic: they change velocities.
  double linear_j = 0.0, quadratic_j = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 force_n = points[i].normal_force_n + points[i].tangential_force_n;
    linear_j += dt_s * glm::dot(force_n, points[i].velocity_mps);
    quadratic_j += 0.5 * dt_s * glm::dot(force_n, after_mps[i] - points[i].velocity_mps);
  }
  const double available_j = std::max(0.0, stored.springs.normal_j + stored.springs.tangential_j);
  if (linear_j + quadratic_j <= available_j) return 1.0;
  if (quadratic_j <= 0.0) return linear_j > 0.0 ? available_j / linear_j : 1.0;
  // The larger root, in the form that does not cancel.
  const double root = std::sqrt(linear_j * linear_j + 4.0 * quadratic_j * available_j);
  const double share =
      linear_j > 0.0 ? 2.0 * available_j / (linear_j + root) : (root - linear_j) / (2.0 * quadratic_j);
  return std::clamp(share, 0.0, 1.0);
}

void store_work(FrozenContact& contact, const glm::dvec3& after_mps, double dt_s,
                StoredEnergy& stored) noexcept {
  const glm::dvec3 displacement_m = 0.5 * dt_s * (contact.velocity_mps + after_mps);
  stored.springs.normal_j -= glm::dot(contact.normal_force_n, displacement_m);
  stored.springs.tangential_j -= glm::dot(contact.tangential_force_n, displacement_m);
  stored.lost_j -= glm::dot(contact.damping_force_n, displacement_m);
  contact.velocity_mps = after_mps;
}

}  // namespace hil::modules
