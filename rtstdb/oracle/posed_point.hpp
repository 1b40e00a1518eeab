#pragma once
// The point of a nearest query and the entities, at the query's time. Internal to the oracle.

#include <glm/ext/vector_double3.hpp>

#include <array>

#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_ray.hpp"

namespace rtstdb::oracle {

struct PosedPoint {
  glm::dvec3 point_m{0.0};
  glm::dvec3 v_mps{0.0};
  double noise_units_m = 0.0;

  PosedPoint(const World& world, const Nearest& point);
  double noise_m(const PosedEntity& entity) const noexcept;
};

/// The nearest point of one target.
struct Measured {
  std::uint32_t triangle = 0;
  double distance_m = 0.0;  ///< without its sign
  double u = 0.0, v = 0.0;
  glm::dvec3 p_world_m{0.0};
};

/// Whether the query admits the entity.
bool looked_at(const EntityState& state, const Nearest& point) noexcept;

/// The nearest point of the bounds, or their centre.
Measured measured_to(const PosedEntity& entity, NearestTarget target, const glm::dvec3& point_m) noexcept;
Measured measured_to_triangle(const PosedEntity& entity, std::uint32_t triangle,
                              const glm::dvec3& point_m) noexcept;

/// The point in the entity's frame, rotated but not scaled, so that lengths are those of the world.
glm::dvec3 in_frame_of(const PosedEntity& entity, const glm::dvec3& point_m) noexcept;

/// Whether the entity's closed surface winds around the point: the signed solid angles of its triangles (Van
/// Oosterom and Strackee 1983) add up to a multiple of the sphere's, not zero.
bool winds_around(const PosedEntity& entity, const glm::dvec3& point_m) noexcept;

/// Velocity of the entity's point minus that of the query's.
glm::dvec3 relative_velocity(const PosedEntity& entity, const PosedPoint& point,
                             const glm::dvec3& p_world_m) noexcept;

}  // namespace rtstdb::oracle
