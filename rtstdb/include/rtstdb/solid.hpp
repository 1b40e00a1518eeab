#pragma once
// Exact shapes of bodies whose mesh only approximates them (GeometryOptions::solid).

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>

namespace rtstdb {

enum class SolidKind : std::uint8_t {
  box,       ///< size_m
  sphere,    ///< radius_m
  capsule,   ///< the points nearer than radius_m to a segment along z of length height_m
  cylinder,  ///< radius_m, height_m along z
};

/// In pairs with a body that has convex parts, contacts and impacts are those of the solid. All other pairs
/// (contact.hpp), and all other queries, use the mesh. An entity's bounds contain the mesh and the solid. A
/// contact point names the nearest triangle of the mesh. An entity's scale applies: a sphere becomes an
/// ellipsoid. The solid's frame has its origin at the solid's centre. Sizes that a kind does not use are
/// ignored.
struct Solid {
  SolidKind kind = SolidKind::box;
  glm::dvec3 size_m{0.0};  ///< of a box: edge lengths
  double radius_m = 0.0;
  double height_m = 0.0;
  glm::dvec3 center_m{0.0};                 ///< entity frame
  glm::dquat q_entity{1.0, 0.0, 0.0, 0.0};  ///< from the solid's frame to the entity's
};

const char* to_string(SolidKind kind) noexcept;

}  // namespace rtstdb
