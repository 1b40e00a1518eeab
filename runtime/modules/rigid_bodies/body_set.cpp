#include "runtime/modules/rigid_bodies/body_set.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>

#include <rtstdb/limits.hpp>

namespace hil::modules {
namespace {

double largest_of(const glm::dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

}  // namespace

BodySet::BodySet(const RigidBodiesOptions& options, std::span<const rtstdb::Motion> motions)
    : gravity_mps2_(options.gravity_mps2),
      bodies_(options.bodies.size()),
      masses_kg_(options.bodies.size()),
      motions_(options.bodies.size()),
      loads_(options.bodies.size()) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    body.row = motions[i];
    if (!options.bodies[i].properties) continue;
    masses_kg_[i] = options.bodies[i].properties->mass_kg;
    body.rigid_body.emplace(*options.bodies[i].properties, options.orbit_radps);
    body.state = body.rigid_body->state(body.row.p_world_m, body.row.v_world_mps, body.row.q_world,
                                        body.row.w_world_radps);
  }
}

std::span<const BodyMotion> BodySet::motions_at(std::int64_t time_ns) noexcept {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (body.rigid_body) {
      motions_[i] = {.p_m = body.state.p_world_m,
                     .v_mps = body.state.v_world_mps,
                     .w_radps = body.rigid_body->w_world_radps(body.state)};
    } else {
      motions_[i] = {.p_m = rtstdb::pose_at(body.row, rtstdb::world_time_ns(time_ns)).p_world_m,
                     .v_mps = body.row.v_world_mps,
                     .w_radps = body.row.w_world_radps};
    }
  }
  return motions_;
}

void BodySet::advance(FrozenContacts& contacts, TouchLog& touches, std::int64_t from_ns, std::int64_t to_ns,
                      double substep_ns) noexcept {
  const auto duration_ns = static_cast<double>(to_ns - from_ns);
  if (duration_ns <= 0.0) return;
  // The share of a substep that rounding may add does not make one more.
  const auto count = static_cast<std::int64_t>(std::max(1.0, std::ceil(duration_ns / substep_ns - 1e-6)));
  const double length_ns = duration_ns / static_cast<double>(count);
  for (std::int64_t i = 0; i < count; ++i) {
    const double begin_ns = static_cast<double>(from_ns) + static_cast<double>(i) * length_ns;
    substep(contacts, touches, begin_ns, 1e-9 * length_ns);
  }
}

void BodySet::drift(double dt_s) noexcept {
  for (Body& body : bodies_)
    if (moves(body)) body.state = body.rigid_body->drifted(body.state, dt_s);
}

void BodySet::kick(double dt_s, bool with_inputs) noexcept {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    if (!moves(body)) continue;
    glm::dvec3 force_n = loads_[i].force_n, torque_nm = loads_[i].torque_nm;
    if (with_inputs) {
      force_n += masses_kg_[i] * gravity_mps2_ + body.state.q_world * body.wrench.force_body_n;
      torque_nm += body.state.q_world * body.wrench.torque_body_nm;
      body.state = body.rigid_body->kicked(body.state, force_n, torque_nm, dt_s);
    } else {
      body.state.v_world_mps += dt_s / masses_kg_[i] * force_n;
      body.state.angular_momentum_world_nms += dt_s * torque_nm;
    }
    motions_[i].v_mps = body.state.v_world_mps;
    motions_[i].w_radps = body.rigid_body->w_world_radps(body.state);
  }
}

void BodySet::substep(FrozenContacts& contacts, TouchLog& touches, double time_ns, double dt_s) noexcept {
  const auto middle_ns = static_cast<std::int64_t>(time_ns + 0.5e9 * dt_s);
  drift(0.5 * dt_s);
  motions_at(middle_ns);
  std::fill(loads_.begin(), loads_.end(), BodyLoad{});
  contacts.add_loads(motions_, middle_ns, dt_s, loads_, touches);
  work_j_ += input_work_j(0.5 * dt_s);
  kick(dt_s, true);
  if (contacts.limit(motions_, dt_s, loads_)) kick(dt_s, false);
  work_j_ += input_work_j(0.5 * dt_s) + contacts.end_substep(motions_, dt_s);
  drift(0.5 * dt_s);
}

double BodySet::input_work_j(double dt_s) const noexcept {
  double power_w = 0.0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (!moves(body)) continue;
    power_w += glm::dot(body.state.q_world * body.wrench.force_body_n, motions_[i].v_mps) +
               glm::dot(body.state.q_world * body.wrench.torque_body_nm, motions_[i].w_radps);
  }
  return dt_s * power_w;
}

void BodySet::halt(Body& body) noexcept {
  body.state =
      body.rigid_body->state(body.state.p_world_m, glm::dvec3(0.0), body.state.q_world, glm::dvec3(0.0));
}

double BodySet::used_of_limits(const Body& body) noexcept {
  return std::max({largest_of(body.state.p_world_m) / rtstdb::max_coordinate_m,
                   glm::length(body.state.v_world_mps) / rtstdb::max_speed_mps,
                   glm::length(body.rigid_body->w_world_radps(body.state)) / rtstdb::max_angular_rate_radps});
}

double BodySet::kinetic_energy_j() const noexcept {
  double energy_j = 0.0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (!body.rigid_body) continue;
    const glm::dvec3& v = body.state.v_world_mps;
    energy_j += 0.5 * masses_kg_[i] * glm::dot(v, v) + body.rigid_body->rotational_energy_j(body.state);
  }
  return energy_j;
}

double BodySet::potential_energy_j() const noexcept {
  double energy_j = 0.0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (!body.rigid_body) continue;
    energy_j += body.rigid_body->orbital_energy_j(body.state) -
                masses_kg_[i] * glm::dot(gravity_mps2_, body.state.p_world_m);
  }
  return energy_j;
}

rtstdb::Motion row_between(const RigidBodyState& begin, const RigidBodyState& end, rtstdb::WorldTime t,
                           double duration_s) noexcept {
  const glm::dquat turn = end.q_world * glm::conjugate(begin.q_world);
  return {.p_world_m = begin.p_world_m,
          .q_world = begin.q_world,
          .v_world_mps = (end.p_world_m - begin.p_world_m) / duration_s,
          .w_world_radps = rotation_vector_rad(turn) / duration_s,
          .valid_from = t};
}

}  // namespace hil::modules
