#pragma once
// A hull in the layout of the device (shaders/shared/contact.h). Pure; allocates.

#include <glm/ext/vector_float4.hpp>

#include <vector>

#include "rtstdb/geometry/convex_hull.hpp"

namespace rtstdb::accel {

std::vector<glm::vec4> hull_texels(const ConvexHull& hull);

}  // namespace rtstdb::accel
