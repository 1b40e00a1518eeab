#pragma once
// The key `rotation` of entities and of parts: three angles or a quaternion.

#include <array>

#include "runtime/config/schema.hpp"

namespace hil::config {

Schema rotation_schema();

/// The rotation as a unit quaternion w, x, y, z; of the body's frame to the frame around it. The identity
/// with a mistake when the quaternion has another length, or stands beside angles. `rotation` is a value of
/// rotation_schema.
std::array<double, 4> read_rotation(const Value& rotation, Diagnostics& diagnostics);

}  // namespace hil::config
