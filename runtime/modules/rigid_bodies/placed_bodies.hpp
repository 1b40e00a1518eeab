#pragma once
// The bodies of the rigid_bodies module as they are placed in the world before the first step, and the checks
// that need their rows and boxes.
//
// Threads: configuration.

#include <span>
#include <string>
#include <vector>

#include <hil/world/world_module.hpp>

#include "runtime/modules/rigid_bodies/body_options.hpp"

namespace hil::modules {

struct PlacedBody {
  rtstdb::EntityRow row;
  /// Corners of the box of its shape, in the body's frame, scaled.
  glm::dvec3 minimum_m{0.0}, maximum_m{0.0};

  double diagonal_m() const noexcept;
  double smallest_edge_m() const noexcept;
};

/// The bodies' rows and boxes, in the order of the options. Throws SetupError, with the numbers, if a row can
/// not be read, and
/// - for a shape without an inside, and for a body in no layer;
/// - for a body that would rest under its weight deeper than half of its smallest edge: contacts have no
///   definite normal there;
/// - if a force at a corner of a body's box moves the corner more in a substep than the stiffness or the
///   damping permits, because its inertia is small.
std::vector<PlacedBody> read_placed_bodies(World& world, const std::string& caller,
                                           const RigidBodiesOptions& options,
                                           std::span<const rtstdb::EntityId> entities, double substep_s);

/// Place and name of a body, for error texts.
std::string place_and_name(const RigidBodyOptions& body);

}  // namespace hil::modules
