#pragma once
// The states of all bodies of the rigid_bodies module, and their motion between two answers of the contact
// query. A body with mass properties moves under gravity, its inputs and the contacts; any other body moves
// as its row does.
//
// Threads: one. Nothing but the constructor allocates.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <rtstdb/entity.hpp>

#include "runtime/modules/rigid_bodies/body_options.hpp"
#include "runtime/modules/rigid_bodies/frozen_contacts.hpp"

namespace hil::modules {

class BodySet {
 public:
  struct Body {
    std::optional<RigidBody> rigid_body{};  ///< empty: fixed
    RigidBodyState state{};                 ///< of one that moves
    rtstdb::Motion row{};                   ///< of a fixed one; else that at run time 0
    Wrench wrench{};                        ///< of the inputs
    bool is_held = false;                   ///< it rests where it is, whatever acts on it
    bool has_stopped = false;  ///< held for good, since it would have left what the database permits
  };

  /// `motions`: of the bodies at run time 0.
  BodySet(const RigidBodiesOptions& options, std::span<const rtstdb::Motion> motions);

  std::span<Body> bodies() noexcept { return bodies_; }
  std::span<const Body> bodies() const noexcept { return bodies_; }

  /// The motions at a run time, which is that of the states. Valid until the next call and advance().
  std::span<const BodyMotion> motions_at(std::int64_t time_ns) noexcept;
  /// Integrates from one run time to another in equal substeps that are not longer than `substep_ns`.
  void advance(FrozenContacts& contacts, TouchLog& touches, std::int64_t from_ns, std::int64_t to_ns,
               double substep_ns) noexcept;
  /// Brings a body that moves to rest where it is.
  static void halt(Body& body) noexcept;
  /// The largest share that a coordinate, the speed or the angular rate of a body has of what the database
  /// permits.
  static double used_of_limits(const Body& body) noexcept;
  /// Kinetic energy of the bodies that move.
  double kinetic_energy_j() const noexcept;
  /// Potential energy of all bodies that move, in gravity and in the orbital frame; 0 at the world's origin.
  double potential_energy_j() const noexcept;

  /// Energy that the inputs and fixed bodies that move have added to the moving bodies so far.
  double work_j() const noexcept { return work_j_; }
  /// Adds a change of energy that is none of the contacts.
  void add_work(double work_j) noexcept { work_j_ += work_j; }

 private:
  static bool moves(const Body& body) noexcept {
    return body.rigid_body && !body.is_held && !body.has_stopped;
  }
  void drift(double dt_s) noexcept;
  /// Changes the momenta by the loads and, if with_inputs, by gravity, the orbit and the inputs.
  void kick(double dt_s, bool with_inputs) noexcept;
  /// Work of the inputs in dt_s at the velocities of motions_.
  double input_work_j(double dt_s) const noexcept;
  void substep(FrozenContacts& contacts, TouchLog& touches, double time_ns, double dt_s) noexcept;

  const glm::dvec3 gravity_mps2_;
  std::vector<Body> bodies_;
  std::vector<double> masses_kg_;  ///< 0: fixed
  std::vector<BodyMotion> motions_;
  std::vector<BodyLoad> loads_;
  double work_j_ = 0.0;
};

/// The row that has both states at its ends: exact at the begin, and at the end up to rounding.
rtstdb::Motion row_between(const RigidBodyState& begin, const RigidBodyState& end, rtstdb::WorldTime t,
                           double duration_s) noexcept;

}  // namespace hil::modules
