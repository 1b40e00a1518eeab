#pragma once
// The key `rotation` of entities and of parts: three angles or a quaternion.

#include <array>

#include <hil/schema.hpp>

namespace hil::config {

Schema rotation_schema();

/// The rotation from the body's frame to the frame around it, as a unit quaternion w, x, y, z. Adds a mistake
/// for a quaternion of another length, and for one that is given together with angles. `rotation` conforms to
/// rotation_schema.
std::array<double, 4> read_rotation(const Value& rotation, Diagnostics& diagnostics);

}  // namespace hil::config
