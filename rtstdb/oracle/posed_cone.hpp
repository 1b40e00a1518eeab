#pragma once
// A cone and the entities, at the cone's time, and the first contact of a triangle with it. Internal to the
// oracle.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <optional>

#include "rtstdb/oracle/posed_ray.hpp"

namespace rtstdb::oracle {

/// The corners of a triangle in the coordinates of a cone: x and y across the axis, z along it, from the
/// apex, in metres.
using ConeCorners = std::array<glm::dvec3, 3>;

/// The part of space whose distance from the axis is at most slope * z + margin, with z_min <= z <= z_max.
struct ConeSpace {
  double slope = 0.0;
  double margin_m = 0.0;
  double z_min_m = 0.0, z_max_m = 0.0;
};

/// The point of the triangle in the space with the least z; none: they do not meet.
std::optional<glm::dvec3> first_point(const ConeCorners& corners, const ConeSpace& space) noexcept;

struct PosedCone {
  PosedRay axis;
  glm::dvec3 x{0.0}, y{0.0}, z{0.0};  ///< unit vectors across and along the axis, in the world
  double half_angle_rad = 0.0;

  PosedCone(const World& world, const Cone& cone);

  bool is_ray() const noexcept { return half_angle_rad == 0.0; }
  double slope() const noexcept;
  glm::dvec3 in_cone(const glm::dvec3& p_world_m) const noexcept;
  glm::dvec3 in_world(const glm::dvec3& p_cone_m) const noexcept;
  ConeCorners corners(const PosedEntity& entity, std::uint32_t triangle) const noexcept;
  /// The cone, widened by `by_m` on all sides; narrowed if `by_m` is negative.
  ConeSpace space(double by_m = 0.0) const noexcept;
  /// Noise of a triangle relative to the cone.
  double noise_m(const PosedEntity& entity, std::uint32_t triangle) const noexcept;
  double noise_m(const PosedEntity& entity) const noexcept;

  /// Calls visit(triangle) for every triangle of the entity that may be within `margin_m` of the cone.
  template <class Visit>
  void walk(const PosedEntity& entity, double margin_m, Visit&& visit) const;
};

/// The ray along the axis.
Ray axis_of(const Cone& cone) noexcept;

/// Above zero where the apex is in front of the triangle: its distance from the triangle's plane.
double apex_height_m(const ConeCorners& corners) noexcept;

/// Whether `faces` admits a triangle. `height_m`: its apex_height_m, uncertain by |noise_m|. With noise_m
/// above 0, a doubtful triangle is admitted; below 0, it is not.
bool admits(Faces faces, double height_m, double noise_m) noexcept;

template <class Visit>
void PosedCone::walk(const PosedEntity& entity, double margin_m, Visit&& visit) const {
  const glm::dvec3 to_center = in_cone(entity.pose.p_world_m);
  const double reach_m = entity.reach() + margin_m;
  const double far_m = std::min(to_center.z + reach_m, axis.lambda_max * axis.length + margin_m);
  if (far_m < -margin_m) return;
  const double radius_m = slope() * std::max(far_m, 0.0) + margin_m / std::cos(half_angle_rad);
  const double rounding_m = 1e-12 * (glm::length(to_center) + reach_m + glm::length(axis.origin_m));
  if (glm::length(glm::dvec2(to_center)) > reach_m + radius_m + rounding_m) return;
  LocalRay local = axis.in_frame_of(entity);
  local.lambda_min = -margin_m / axis.length;
  local.lambda_max = far_m / axis.length + std::abs(rounding_m) / axis.length;
  entity.mesh->walk(local, (radius_m + rounding_m) / entity.state->row.scale, visit);
}

}  // namespace rtstdb::oracle
