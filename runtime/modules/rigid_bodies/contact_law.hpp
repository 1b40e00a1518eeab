#pragma once
// The force at a contact point: a spring and a damper along the normal, and a spring with Coulomb friction
// across it.
//
//   normal   N = stiffness * depth + damping * approach speed; never negative, and 0 without depth
//   across   A spring of the same stiffness and damping, anchored where the bodies were when the contact
//            began. It slips when the spring's force exceeds friction * N: then its anchor follows. The whole
//            force across is at most friction * N.
//
// Between two answers of the contact query the plane of the contact is frozen: its normal stays, and the
// depth changes by the motion of one body relative to the other at the point, along the normal. The point
// moves with the smaller body of the pair, without turning with it, so that it stays below the centre of a
// body that rolls on a larger one; between bodies of one size it stays midway.
//
// SI units, world axes. Threads: pure functions and plain data.
// Source: Cundall, Strack, "A discrete numerical model for granular assemblies", 1979.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>

namespace hil::modules {

struct ContactLaw {
  double stiffness_npm = 0.0;  ///< of a pair: its points share it
  double damping_nspm = 0.0;   ///< of a pair
  double friction = 0.0;
};

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
  double share = 1.0;                   ///< of the pair's stiffness and damping
  /// From the origins of the bodies to the point when it was frozen.
  glm::dvec3 first_arm_m{0.0}, second_arm_m{0.0};
  double first_weight = 0.5;  ///< 1: the point moves with the first body; 0: with the second
  glm::dvec3 stretch_m{0.0};  ///< of the spring across the normal: the first body relative to its anchor
  bool is_new = true;         ///< it has no anchor of an earlier answer
  bool is_kept = false;       ///< it is of an earlier answer, since the last one does not decide the pair
};

/// Where the point is.
glm::dvec3 place_of(const FrozenContact& contact, const BodyMotion& first, const BodyMotion& second) noexcept;

/// The velocity of the first body at the place relative to the second.
glm::dvec3 relative_velocity(const glm::dvec3& place_m, const BodyMotion& first,
                             const BodyMotion& second) noexcept;

/// Updates the stretch of the spring and the depth by the motion of a completed substep: `velocity_mps` is
/// relative_velocity() after it. `depth_is_known`: the depth is that of an answer at this time, and stays.
void follow(FrozenContact& contact, const glm::dvec3& velocity_mps, double dt_s,
            bool depth_is_known) noexcept;

/// The force on the first body; the second has the opposite one. Reduces the stretch of a spring that slips,
/// and resets it where nothing presses.
glm::dvec3 contact_force(FrozenContact& contact, const ContactLaw& law,
                         const glm::dvec3& velocity_mps) noexcept;

}  // namespace hil::modules
