#include "runtime/modules/free_body/rigid_body.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include <hil/numbers.hpp>
#include <hil/require.hpp>

namespace hil::modules {
namespace {

constexpr double min_moment_kgm2 = 1e-12;

/// The smallest principal minor of each size, relative to the trace. All are positive for a positive definite
/// tensor, and none is negative for a positive semidefinite one.
double min_relative_minor(const glm::dmat3& m) {
  const double trace = m[0][0] + m[1][1] + m[2][2];
  const auto pair = [&](int i, int j) { return (m[i][i] * m[j][j] - m[i][j] * m[j][i]) / (trace * trace); };
  return std::min({m[0][0] / trace, m[1][1] / trace, m[2][2] / trace, pair(0, 1), pair(0, 2), pair(1, 2),
                   glm::determinant(m) / (trace * trace * trace)});
}

}  // namespace

glm::dquat turned(const glm::dquat& q, const glm::dvec3& turn_rad) noexcept {
  // Below this half angle the next term of the series of sin(x) / x is under one part in 2^53.
  constexpr double series_below = 1e-4;
  const double half = 0.5 * glm::length(turn_rad);
  const double half_sinc = half < series_below ? 0.5 - half * half / 12.0 : 0.5 * std::sin(half) / half;
  const glm::dvec3 part = half_sinc * turn_rad;
  return glm::dquat(std::cos(half), part.x, part.y, part.z) * q;
}

glm::dvec3 rotation_vector_rad(const glm::dquat& turn) noexcept {
  const double sign = turn.w < 0.0 ? -1.0 : 1.0;
  const glm::dvec3 part = sign * glm::dvec3(turn.x, turn.y, turn.z);
  const double half_sine = glm::length(part);
  constexpr double series_below = 1e-8;
  if (half_sine < series_below) return 2.0 * part;
  return (2.0 * std::atan2(half_sine, sign * turn.w) / half_sine) * part;
}

std::string fault_of_inertia(const glm::dmat3& inertia_kgm2) {
  // Values of a scenario have few digits: the largest moment of a plate, which is the sum of the others, may
  // exceed this sum by rounding.
  constexpr double rounding = 1e-6;
  constexpr double min_definite = 1e-15;
  const glm::dmat3& m = inertia_kgm2;
  const double trace = m[0][0] + m[1][1] + m[2][2];
  const std::string diagonal = "xx is " + config::format_number(m[0][0]) + ", yy " +
                               config::format_number(m[1][1]) + ", zz " + config::format_number(m[2][2]) +
                               " kg m2: ";
  if (std::min({m[0][0], m[1][1], m[2][2]}) < min_moment_kgm2)
    return diagonal + "each has to be at least " + config::format_number(min_moment_kgm2) + " kg m2";
  if (!(min_relative_minor(m) > min_definite))
    return diagonal + "the tensor is not positive definite, but a body resists rotation about every axis";
  if (min_relative_minor(glm::dmat3(0.5 * trace) - m) < -rounding)
    return diagonal +
           "one principal moment is larger than the sum of the other two, but in no body it can be";
  return {};
}

RigidBody::RigidBody(const MassProperties& properties, double orbit_radps)
    : properties_(properties),
      inverse_inertia_(glm::inverse(properties.inertia_kgm2)),
      orbit_radps_(0.0, 0.0, orbit_radps) {
  config::require(properties.mass_kg > 0.0, "the mass of a body is positive");
  config::require(fault_of_inertia(properties.inertia_kgm2).empty(), "a body can have the inertia tensor");
}

RigidBodyState RigidBody::state(const glm::dvec3& p_world_m, const glm::dvec3& v_world_mps,
                                const glm::dquat& q_world, const glm::dvec3& w_world_radps) const noexcept {
  const glm::dquat q = glm::normalize(q_world);
  const glm::dvec3 w_body = glm::conjugate(q) * (w_world_radps + orbit_radps_);
  return {.p_world_m = p_world_m,
          .v_world_mps = v_world_mps,
          .q_world = q,
          .angular_momentum_world_nms = q * (properties_.inertia_kgm2 * w_body)};
}

glm::dvec3 RigidBody::w_body_radps(const RigidBodyState& state) const noexcept {
  return inverse_inertia_ * (glm::conjugate(state.q_world) * state.angular_momentum_world_nms);
}

glm::dvec3 RigidBody::w_world_radps(const RigidBodyState& state) const noexcept {
  return state.q_world * w_body_radps(state) - orbit_radps_;
}

double RigidBody::rotational_energy_j(const RigidBodyState& state) const noexcept {
  const glm::dvec3 w = w_body_radps(state);
  return 0.5 * glm::dot(w, properties_.inertia_kgm2 * w);
}

glm::dvec3 RigidBody::orbital_acceleration_mps2(const RigidBodyState& state) const noexcept {
  const double n = orbit_radps_.z;
  const glm::dvec3& p = state.p_world_m;
  const glm::dvec3& v = state.v_world_mps;
  return {3.0 * n * n * p.x + 2.0 * n * v.y, -2.0 * n * v.x, -n * n * p.z};
}

RigidBody::Derivative RigidBody::derivative(const RigidBodyState& state,
                                            const Wrench& wrench) const noexcept {
  const glm::dvec3 w = w_world_radps(state);
  return {
      .v_mps = state.v_world_mps,
      .a_mps2 = orbital_acceleration_mps2(state) + state.q_world * wrench.force_body_n / properties_.mass_kg,
      .q_per_s = 0.5 * (glm::dquat(0.0, w.x, w.y, w.z) * state.q_world),
      .torque_nm =
          state.q_world * wrench.torque_body_nm - glm::cross(orbit_radps_, state.angular_momentum_world_nms)};
}

RigidBodyState RigidBody::moved(const RigidBodyState& state, const Derivative& rate, double dt_s) noexcept {
  return {.p_world_m = state.p_world_m + dt_s * rate.v_mps,
          .v_world_mps = state.v_world_mps + dt_s * rate.a_mps2,
          .q_world = state.q_world + dt_s * rate.q_per_s,
          .angular_momentum_world_nms = state.angular_momentum_world_nms + dt_s * rate.torque_nm};
}

RigidBodyState RigidBody::step(const RigidBodyState& state, const Wrench& wrench,
                               double dt_s) const noexcept {
  const Derivative k1 = derivative(state, wrench);
  const Derivative k2 = derivative(moved(state, k1, 0.5 * dt_s), wrench);
  const Derivative k3 = derivative(moved(state, k2, 0.5 * dt_s), wrench);
  const Derivative k4 = derivative(moved(state, k3, dt_s), wrench);
  const auto mean = [](const auto& a, const auto& b, const auto& c, const auto& d) {
    return (a + 2.0 * b + 2.0 * c + d) / 6.0;
  };
  RigidBodyState next = moved(state,
                              {.v_mps = mean(k1.v_mps, k2.v_mps, k3.v_mps, k4.v_mps),
                               .a_mps2 = mean(k1.a_mps2, k2.a_mps2, k3.a_mps2, k4.a_mps2),
                               .q_per_s = mean(k1.q_per_s, k2.q_per_s, k3.q_per_s, k4.q_per_s),
                               .torque_nm = mean(k1.torque_nm, k2.torque_nm, k3.torque_nm, k4.torque_nm)},
                              dt_s);
  next.q_world = glm::normalize(next.q_world);
  return next;
}

RigidBodyState RigidBody::drifted(const RigidBodyState& state, double dt_s) const noexcept {
  RigidBodyState next = state;
  next.p_world_m += dt_s * next.v_world_mps;
  RigidBodyState middle = state;
  middle.q_world = turned(state.q_world, 0.5 * dt_s * w_world_radps(state));
  next.q_world = glm::normalize(turned(state.q_world, dt_s * w_world_radps(middle)));
  return next;
}

RigidBodyState RigidBody::kicked(const RigidBodyState& state, const glm::dvec3& force_world_n,
                                 const glm::dvec3& torque_world_nm, double dt_s) const noexcept {
  RigidBodyState next = state;
  next.v_world_mps += dt_s * (orbital_acceleration_mps2(state) + force_world_n / properties_.mass_kg);
  next.angular_momentum_world_nms +=
      dt_s * (torque_world_nm - glm::cross(orbit_radps_, state.angular_momentum_world_nms));
  return next;
}

double RigidBody::orbital_energy_j(const RigidBodyState& state) const noexcept {
  const double n = orbit_radps_.z;
  const glm::dvec3& p = state.p_world_m;
  return 0.5 * properties_.mass_kg * n * n * (p.z * p.z - 3.0 * p.x * p.x);
}

}  // namespace hil::modules
