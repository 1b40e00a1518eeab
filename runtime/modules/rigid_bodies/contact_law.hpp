#pragma once
// The forces at the contact points of a pair of bodies: a spring and a damper along each normal, a friction
// spring and a damper across it, and the elastic energy of the pair.
//
//   share        Each point has a share of the pair's stiffness and damping: its depth divided by the sum of
//                the depths. So a force changes continuously when a point comes or goes, and points of equal
//                depth have the force of one.
//   normal       N = stiffness * depth + damping * approach speed; never negative, and 0 without depth
//   tangential   A friction spring of the same stiffness and damping, anchored where the bodies were when the
//                contact began. It slips when the spring's force exceeds friction * N: then its anchor moves.
//                Spring and damper together have at most friction * N.
//   energy       A pair stores the work that is done against its springs, and returns no more. While the
//                bodies approach, the springs have at least the stiffness of the law; while they part, that
//                stiffness times the stored energy divided by the energy that the law has at these depths. So
//                the stored energy reaches zero where the depth does, whatever the normals, points and shares
//                were before, and the factor is 1 where the law itself is conservative. The friction
//                springs store separately from those along the normals, and never more than the law has. The
//                energy that a pair's dampers took and its springs lost may refill the springs along the
//                normals, up to the energy of the law.
//
// Between two answers of the contact query the plane of the contact is frozen: its normal stays, and the
// depth changes by the motion of one body relative to the other at the point, along the normal. The point
// moves with the smaller body of the pair, without turning with it, so that it stays below the centre of a
// body that rolls on a larger one; between bodies of one size it stays midway.
//
// SI units, world axes. Threads: pure functions and plain data.
// Source: Cundall, Strack, "A discrete numerical model for granular assemblies", 1979; Hannaford, Ryu,
// "Time-domain passivity control of haptic interfaces", 2002.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <span>

namespace hil::modules {

struct ContactLaw {
  double stiffness_npm = 0.0;  ///< of a pair: its points share it
  double damping_nspm = 0.0;   ///< of a pair
  double friction = 0.0;
};

/// The springs of a pair have at most this times the stiffness of the law. Energy beyond that is lost.
inline constexpr double max_stiffening = 2.0;

/// The motion of a body at an instant: of its origin, and its angular rate.
struct BodyMotion {
  glm::dvec3 p_m{0.0};
  glm::dvec3 v_mps{0.0};
  glm::dvec3 w_radps{0.0};
};

struct FrozenContact {
  std::uint32_t first = 0, second = 0;  ///< numbers of the bodies
  glm::dvec3 normal{0.0};               ///< unit, from the second body to the first
  double depth_m = 0.0;                 ///< negative: the surfaces are apart
  double mean_depth_m = 0.0;            ///< in the substep, with a negative depth as 0
  /// From the origins of the bodies to the point when it was frozen.
  glm::dvec3 first_arm_m{0.0}, second_arm_m{0.0};
  double first_weight = 0.5;  ///< 1: the point moves with the first body; 0: with the second
  glm::dvec3 stretch_m{0.0};  ///< of the friction spring: the first body relative to its anchor
  /// Velocity of the first body relative to the second, at the point.
  glm::dvec3 velocity_mps{0.0};
  /// Forces on the first body of the normal and the friction spring, and of the dampers; the second body
  /// has the opposite ones.
  glm::dvec3 normal_force_n{0.0}, tangential_force_n{0.0}, damping_force_n{0.0};

  glm::dvec3 force_n() const noexcept { return normal_force_n + tangential_force_n + damping_force_n; }
};

/// Where the point is.
glm::dvec3 place_of(const FrozenContact& contact, const BodyMotion& first, const BodyMotion& second) noexcept;

/// The velocity of the first body at the place relative to the second.
glm::dvec3 relative_velocity(const glm::dvec3& place_m, const BodyMotion& first,
                             const BodyMotion& second) noexcept;

/// Updates the depth and the stretch of the spring by a motion with the contact's velocity.
void advance(FrozenContact& contact, double dt_s) noexcept;

/// Energy of the springs of one pair.
struct SpringEnergy {
  double normal_j = 0.0;      ///< negative: they returned more than they stored, and recover that first
  double tangential_j = 0.0;  ///< as normal_j
};
struct StoredEnergy {
  SpringEnergy springs;
  double lost_j = 0.0;  ///< taken by the dampers and lost by all springs; at most the energy of the law
};

/// The energy that the springs of one pair have by the law.
SpringEnergy law_energy(std::span<const FrozenContact> points, const ContactLaw& law) noexcept;

/// Sets the forces of the points of one pair, whose depths and velocities are those at the middle of a
/// substep, and `begin` is law_energy at its begin. Reduces the stretch of springs that slip, and resets it
/// where the normal force is zero. Springs along the normal lose stored energy beyond max_stiffening at once,
/// and beyond the law's energy at the rate `decay_per_s`; friction springs lose all beyond the law's.
void set_forces(std::span<FrozenContact> points, const ContactLaw& law, const SpringEnergy& begin,
                double dt_s, double decay_per_s, StoredEnergy& stored) noexcept;

/// The largest share of the springs' forces, up to 1, whose work in a substep does not exceed the stored
/// energy. `after_mps`: the velocities of the points after the whole forces have acted.
double max_force_share(std::span<const FrozenContact> points, std::span<const glm::dvec3> after_mps,
                       double dt_s, const StoredEnergy& stored) noexcept;

/// Adds the work that the bodies did against the forces of a point in a substep, in which the velocity went
/// from the contact's to `after_mps`, which becomes the contact's.
void store_work(FrozenContact& contact, const glm::dvec3& after_mps, double dt_s,
                StoredEnergy& stored) noexcept;

}  // namespace hil::modules
