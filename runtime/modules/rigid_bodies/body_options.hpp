#pragma once
// The parameters of the rigid_bodies module, and the limits within which its contacts are stable.
//
// Threads: configuration.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/modules/free_body/body_row.hpp"
#include "runtime/modules/free_body/rigid_body.hpp"
#include "runtime/modules/rigid_bodies/contact_law.hpp"

namespace hil::modules {

inline constexpr std::size_t max_rigid_bodies = 64;
/// Of a pair, with h the substep and m its mass: the reduced mass of two bodies, or the mass of one that
/// touches a fixed body.
inline constexpr double max_stiffness_share = 0.1;  ///< stiffness at most this times m / h^2
inline constexpr double max_damping_share = 0.2;    ///< damping at most this times m / h

struct RigidBodyOptions {
  std::string name;
  config::Place place;                       ///< of the name in the scenario
  std::optional<MassProperties> properties;  ///< empty: the body is fixed, or moved by another module
};

struct RigidBodiesOptions {
  std::vector<RigidBodyOptions> bodies;
  glm::dvec3 gravity_mps2{0.0};
  double orbit_radps = 0.0;
  ContactLaw law;
  double margin_m = 0.0;
  std::uint32_t substeps = 1;
  std::uint32_t max_pairs = 1;
  RowError permitted;
};

config::Schema rigid_bodies_schema();

/// Empty if the parameters break a rule that the schema does not have; then `diagnostics` has the mistakes.
std::optional<RigidBodiesOptions> read_rigid_bodies(const config::Value& parameters,
                                                    config::Diagnostics& diagnostics);

/// Adds a mistake for a stiffness or a damping above its limit, with the numbers and the pair of bodies.
void check_contact_law(const RigidBodiesOptions& options, const config::Value& parameters, double substep_s,
                       config::Diagnostics& diagnostics);

}  // namespace hil::modules
