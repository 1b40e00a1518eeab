#pragma once
// The position and velocity of one docking port relative to another one.
//
// A port is a point of a body and an axis out of the body. Ports are joined when their points coincide and
// their axes are opposite. SI units. Threads: pure functions.

#include <glm/ext/vector_double3.hpp>

#include <rtstdb/entity.hpp>

namespace hil::modules {

struct BodyPort {
  glm::dvec3 point_m{0.0};         ///< in the frame of its body
  glm::dvec3 axis{1.0, 0.0, 0.0};  ///< unit vector out of the body
};

/// The port of the chaser as seen from the port of the target.
struct RelativePort {
  double distance_m = 0.0;         ///< along the target's axis; negative: the chaser is past the port
  double lateral_m = 0.0;          ///< from that axis
  double off_axis_rad = 0.0;       ///< between that axis and the line to the chaser's port
  double misalignment_rad = 0.0;   ///< between the chaser's axis and the opposite of the target's
  double closing_speed_mps = 0.0;  ///< along the target's axis; positive: toward the port
  double lateral_speed_mps = 0.0;  ///< across it
};

/// Of both motions at time t. Velocities are relative to the target's body, which may turn.
RelativePort relative_port(const rtstdb::Motion& chaser, const BodyPort& chaser_port,
                           const rtstdb::Motion& target, const BodyPort& target_port,
                           rtstdb::WorldTime t) noexcept;

}  // namespace hil::modules
