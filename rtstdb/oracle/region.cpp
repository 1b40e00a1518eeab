#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <rtstdb/result.hpp>

#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_ray.hpp"
#include "rtstdb/oracle/posed_region.hpp"

namespace rtstdb::oracle {
namespace {

/// The extent of the box from its centre along a unit direction.
double extent_along(const OrientedBox& box, const glm::dvec3& direction) {
  return box.half_extent_m.x * std::abs(glm::dot(box.axis[0], direction)) +
         box.half_extent_m.y * std::abs(glm::dot(box.axis[1], direction)) +
         box.half_extent_m.z * std::abs(glm::dot(box.axis[2], direction));
}

/// Separating axis test: two boxes are apart exactly when one of 15 axes separates them. Returns the largest
/// gap along any of them.
double separation_m(const OrientedBox& a, const OrientedBox& b) {
  double largest = -std::numeric_limits<double>::infinity();
  const auto try_axis = [&](const glm::dvec3& axis) {
    const double gap =
        std::abs(glm::dot(b.center_m - a.center_m, axis)) - extent_along(a, axis) - extent_along(b, axis);
    largest = std::max(largest, gap);
  };
  for (const glm::dvec3& axis : a.axis)
    try_axis(axis);
  for (const glm::dvec3& axis : b.axis)
    try_axis(axis);
  for (const glm::dvec3& edge_a : a.axis) {
    for (const glm::dvec3& edge_b : b.axis) {
      const glm::dvec3 across = glm::cross(edge_a, edge_b);
      const double sine = glm::length(across);
      // Parallel edges give no axis; the face normals cover this direction.
      if (sine > 1e-10) try_axis(across / sine);
    }
  }
  return largest;
}

/// Signed distance of a point to a box: negative inside.
double distance_m(const OrientedBox& box, const glm::dvec3& p) {
  glm::dvec3 beyond(0.0);
  for (int i = 0; i < 3; ++i)
    beyond[i] = std::abs(glm::dot(box.axis[i], p - box.center_m)) - box.half_extent_m[i];
  const double deepest = std::max({beyond.x, beyond.y, beyond.z});
  return deepest <= 0.0 ? deepest : glm::length(glm::max(beyond, glm::dvec3(0.0)));
}

/// How far the inner box reaches beyond the outer one's faces; not above zero when it lies inside.
double sticks_out_m(const OrientedBox& inner, const OrientedBox& outer) {
  double most = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double offset_m = std::abs(glm::dot(outer.axis[i], inner.center_m - outer.center_m));
    most = std::max(most, offset_m + extent_along(inner, outer.axis[i]) - outer.half_extent_m[i]);
  }
  return most;
}

double farthest_corner_m(const OrientedBox& box, const glm::dvec3& p) {
  glm::dvec3 reach(0.0);
  for (int i = 0; i < 3; ++i)
    reach[i] = std::abs(glm::dot(box.axis[i], p - box.center_m)) + box.half_extent_m[i];
  return glm::length(reach);
}

double gap_m(const Region& region, const OrientedBox& shape, const OrientedBox& entity) {
  const bool inside = region.test == RegionTest::inside;
  if (region.shape == RegionShape::box)
    return inside ? sticks_out_m(entity, shape) : separation_m(shape, entity);
  if (region.shape == RegionShape::frustum) {
    const Frustum frustum = frustum_of(region, shape);
    return inside ? sticks_out_m(entity, frustum) : separation_m(frustum, entity);
  }
  const double radius_m = shape.half_extent_m.x;
  return (inside ? farthest_corner_m(entity, shape.center_m) : distance_m(entity, shape.center_m)) - radius_m;
}

OrientedBox oriented_bounds(const PosedEntity& entity) {
  return oriented_box(entity.mesh->bounds(), entity.state->row.scale, entity.pose);
}

double own_noise_units(const PosedEntity& entity) {
  return noise_units_m(*entity.state, entity.pose, entity.dt_s, entity.reach());
}

}  // namespace

std::vector<EntityGap> gaps(const World& world, const Region& region) {
  const PosedRegion where = posed_region(world, region);
  std::vector<EntityGap> all;
  for (const EntityState& state : world.entities()) {
    if (!visible(state, region.mask)) continue;
    const PosedEntity entity = posed(world, state, region.t, false);
    all.push_back({state.id, gap_m(region, where.box, oriented_bounds(entity)),
                   noise_per_unit * (where.noise_units + own_noise_units(entity))});
  }
  return all;
}

std::vector<EntityGap> gaps(const World& world, const Overlap& overlap) {
  const EntityState* self = world.find(overlap.entity);
  RTSTDB_ASSERT(self != nullptr && self->row.geometry.valid(),
                "the entity does not exist, or has no geometry");
  const PosedEntity at = posed(world, *self, overlap.t, false);
  const OrientedBox own = oriented_bounds(at);
  std::vector<EntityGap> all;
  for (const EntityState& state : world.entities()) {
    if (&state == self || !visible(state, overlap.mask)) continue;
    const PosedEntity entity = posed(world, state, overlap.t, false);
    all.push_back({state.id, separation_m(own, oriented_bounds(entity)),
                   noise_per_unit * (own_noise_units(at) + own_noise_units(entity))});
  }
  return all;
}

}  // namespace rtstdb::oracle
