#pragma once
// The equations of motion of a rigid body. With a constant force and torque in its own frame they are
// integrated by the classical Runge-Kutta method of order 4, with forces that change from step to step, as
// those of contacts do, by the leapfrog method.
//
// The world frame may turn about its z axis with the constant rate of an orbit: then it is the frame of
// Clohessy and Wiltshire ("Terminal Guidance System for Satellite Rendezvous", J. Aerospace Sci. 27, 1960),
// with x away from the planet, y along the velocity of the orbit, and z along its angular momentum. With the
// rate 0 the world frame is inertial.
//
// The angular momentum L is a state of its own, so a body without torque keeps it, in an inertial frame
// exactly. The angular rates follow from it: w = I^-1 L.
//
// SI units. Threads: pure functions.

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <string>

namespace hil::modules {

struct MassProperties {
  double mass_kg = 1.0;
  glm::dmat3 inertia_kgm2{1.0};  ///< about the centre of mass, in the body frame; symmetric
};

/// Why no body has this inertia tensor, as a sentence with its moments; empty: a body can have it. The
/// moments are at least 1e-12 kg m2, the tensor is positive definite, and no principal moment is larger than
/// the sum of the other two.
std::string fault_of_inertia(const glm::dmat3& inertia_kgm2);

/// Force and torque on the body at its centre of mass, in the body frame.
struct Wrench {
  glm::dvec3 force_body_n{0.0};
  glm::dvec3 torque_body_nm{0.0};
};

/// The rotation by the angle and about the axis of a rotation vector, before which q is applied: the
/// exponential map.
glm::dquat turned(const glm::dquat& q, const glm::dvec3& turn_rad) noexcept;
/// The rotation vector of a rotation by at most half a turn: the inverse of turned().
glm::dvec3 rotation_vector_rad(const glm::dquat& turn) noexcept;

struct RigidBodyState {
  glm::dvec3 p_world_m{0.0};  ///< of the centre of mass
  glm::dvec3 v_world_mps{0.0};
  glm::dquat q_world{1.0, 0.0, 0.0, 0.0};  ///< body frame to world frame; unit length
  /// Against an inertial frame, along the world axes.
  glm::dvec3 angular_momentum_world_nms{0.0};
};

class RigidBody {
 public:
  /// `orbit_radps`: the rate at which the world frame turns about z. Misuse: a mass that is not positive, or
  /// a tensor with a fault.
  RigidBody(const MassProperties& properties, double orbit_radps);

  /// The state of a body that turns with w_world_radps against the world frame.
  RigidBodyState state(const glm::dvec3& p_world_m, const glm::dvec3& v_world_mps, const glm::dquat& q_world,
                       const glm::dvec3& w_world_radps) const noexcept;
  /// Against the world frame, along the world axes.
  glm::dvec3 w_world_radps(const RigidBodyState& state) const noexcept;
  /// Against an inertial frame, along the body axes: what a gyroscope on the body measures.
  glm::dvec3 w_body_radps(const RigidBodyState& state) const noexcept;
  /// Energy of the rotation, against an inertial frame.
  double rotational_energy_j(const RigidBodyState& state) const noexcept;

  /// The state after dt_s. The error of one step is of order dt_s^5.
  RigidBodyState step(const RigidBodyState& state, const Wrench& wrench, double dt_s) const noexcept;
  // A step of the leapfrog method is drifted() by half a step, kicked() by a whole step with the forces
  // there, and drifted() by half a step. The work of a constant force in it is exactly the force times the
  // mean of the velocities before and after the kick.

  /// The state after dt_s of motion with the momenta that it has. The rotation is exact for the angular rate
  /// at the middle, which follows from the angular momentum: there is no gyroscopic term that could become
  /// unstable.
  RigidBodyState drifted(const RigidBodyState& state, double dt_s) const noexcept;
  /// The state with the momenta that a force and a torque along the world axes give it in dt_s, at its pose.
  RigidBodyState kicked(const RigidBodyState& state, const glm::dvec3& force_world_n,
                        const glm::dvec3& torque_world_nm, double dt_s) const noexcept;
  /// Potential energy in the orbital frame. Motion without other forces conserves its sum with the kinetic
  /// energy.
  double orbital_energy_j(const RigidBodyState& state) const noexcept;

 private:
  struct Derivative {
    glm::dvec3 v_mps, a_mps2;
    glm::dquat q_per_s;
    glm::dvec3 torque_nm;
  };
  Derivative derivative(const RigidBodyState& state, const Wrench& wrench) const noexcept;
  /// Acceleration in the frame that turns with the orbit.
  glm::dvec3 orbital_acceleration_mps2(const RigidBodyState& state) const noexcept;
  static RigidBodyState moved(const RigidBodyState& state, const Derivative& rate, double dt_s) noexcept;

  MassProperties properties_;
  glm::dmat3 inverse_inertia_;
  glm::dvec3 orbit_radps_;  ///< of the world frame against an inertial one
};

}  // namespace hil::modules
