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

void follow(FrozenContact& contact, const glm::dvec3& velocity_mps, double dt_s,
            bool depth_is_known) noexcept {
  if (!depth_is_known) contact.depth_m -= dt_s * glm::dot(velocity_mps, contact.normal);
  contact.stretch_m += dt_s * across(velocity_mps, contact.normal);
}

glm::dvec3 contact_force(FrozenContact& contact, const ContactLaw& law,
                         const glm::dvec3& velocity_mps) noexcept {
  const double stiffness = contact.share * law.stiffness_npm;
  const double damping = contact.share * law.damping_nspm;
  const double approach_mps = -glm::dot(velocity_mps, contact.normal);
  const double pressed_n =
      contact.depth_m > 0.0 ? std::max(0.0, stiffness * contact.depth_m + damping * approach_mps) : 0.0;
  if (pressed_n == 0.0) {
    contact.stretch_m = glm::dvec3(0.0);
    return glm::dvec3(0.0);
  }
  const double max_across_n = law.friction * pressed_n;
  contact.stretch_m = limited(contact.stretch_m, max_across_n / stiffness);
  const glm::dvec3 across_n =
      -(stiffness * contact.stretch_m + damping * across(velocity_mps, contact.normal));
  return pressed_n * contact.normal + limited(across_n, max_across_n);
}

}  // namespace hil::modules
