#include "rtstdb/oracle/contact_surface.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>

#include <rtstdb/result.hpp>

namespace rtstdb::oracle {
namespace {

/// Bounds of a depth are at most this apart, relative to the diagonal of the smaller body.
constexpr double depth_accuracy = 5e-4;

const EntityState& state_of(const World& world, EntityId id) {
  const EntityState* state = world.find(id);
  RTSTDB_ASSERT(state != nullptr && state->row.geometry.valid(),
                "the entity does not exist, or has no geometry");
  return *state;
}

SurfaceBody surface_of(const World& world, const PosedEntity& entity, const glm::dvec3& origin_m) {
  return {entity, world.has_inside(*entity.state), origin_m};
}

void find_depth(const SurfacePair& pair, SurfaceTruth& truth) {
  const double accuracy_m = depth_accuracy * truth.smaller_diagonal_m;
  SurfaceDepth of_first;
  SurfaceDepth of_second;
  if (pair.second_surface.has_inside())
    of_first = surface_depth(pair.first_surface, pair.second_surface, accuracy_m);
  if (pair.first_surface.has_inside())
    of_second = surface_depth(pair.second_surface, pair.first_surface, accuracy_m, of_first.min_m);
  truth.max_depth_m = std::max(of_first.max_m, of_second.max_m);
  truth.min_depth_m = std::max(of_first.min_m, of_second.min_m);
  if (truth.min_depth_m <= (truth.is_contact ? 0.0 : truth.precision_m)) return;
  if (of_second.min_m > 0.0) {
    truth.p_first_m = of_second.nearest_m;
    truth.p_second_m = of_second.p_m;
    truth.first_triangle = of_second.nearest_triangle;
    truth.second_triangle = of_second.triangle;
  } else {
    truth.p_first_m = of_first.p_m;
    truth.p_second_m = of_first.nearest_m;
    truth.first_triangle = of_first.triangle;
    truth.second_triangle = of_first.nearest_triangle;
  }
}

}  // namespace

double surface_precision_m(const SurfaceBody& first, const SurfaceBody& second, double distance_m) {
  const SurfaceBody& larger = first.diagonal_m() >= second.diagonal_m() ? first : second;
  return std::max(1e-4 * std::min(first.diagonal_m(), second.diagonal_m()),
                  4.0 * double{std::numeric_limits<float>::epsilon()} *
                      std::max(larger.largest_coordinate_m(), distance_m));
}

bool has_component_in(const SurfaceBody& surface, const SurfaceBody& body) {
  if (!body.has_inside()) return false;
  const auto points = surface.component_points();
  return std::ranges::any_of(points, [&](const glm::dvec3& p) { return body.is_inside(p); });
}

bool is_surface_pair(const World& world, EntityId first, EntityId second) {
  return world.parts_of(state_of(world, first)).empty() || world.parts_of(state_of(world, second)).empty();
}

SurfacePair::SurfacePair(const World& world, EntityId first_id, EntityId second_id, WorldTime t)
    : first(posed(world, state_of(world, first_id), t, false)),
      second(posed(world, state_of(world, second_id), t, false)),
      first_surface(surface_of(world, first, first.pose.p_world_m)),
      second_surface(surface_of(world, second, first.pose.p_world_m)) {}

double SurfaceTruth::depth_tolerance_m() const noexcept {
  return surface_depth_tolerance * smaller_diagonal_m + depth_relative_tolerance * max_depth_m + precision_m;
}

bool SurfaceTruth::is_certain_contact() const noexcept {
  if (!is_contact) return false;
  return has_depth ? min_depth_m > depth_tolerance_m() : crossing_margin_m > precision_m;
}

SurfaceTruth surface_truth(const SurfacePair& pair) {
  const SurfaceBody& first = pair.first_surface;
  const SurfaceBody& second = pair.second_surface;
  SurfaceTruth truth;
  truth.has_depth = first.has_inside() || second.has_inside();
  truth.smaller_diagonal_m = std::min(first.diagonal_m(), second.diagonal_m());
  if (const auto crossing = surface_crossing(first, second)) {
    truth.is_contact = true;
    truth.crossing_margin_m = crossing->margin_m;
    truth.p_first_m = truth.p_second_m = crossing->p_m;
    truth.first_triangle = crossing->first_triangle;
    truth.second_triangle = crossing->second_triangle;
  } else {
    const SurfaceGap gap = surface_gap(first, second);
    truth.distance_m = gap.distance_m;
    truth.p_first_m = gap.p_first_m;
    truth.p_second_m = gap.p_second_m;
    truth.first_triangle = gap.first_triangle;
    truth.second_triangle = gap.second_triangle;
    truth.is_contact =
        gap.distance_m == 0.0 || has_component_in(first, second) || has_component_in(second, first);
  }
  truth.precision_m = surface_precision_m(first, second, truth.distance_m);
  // Surfaces that only touch at edges and coplanar triangles may be those of bodies that penetrate.
  const bool may_penetrate = truth.is_contact || truth.distance_m <= truth.precision_m;
  if (may_penetrate && truth.has_depth) find_depth(pair, truth);
  truth.is_contact = truth.is_contact || truth.min_depth_m > truth.precision_m;
  return truth;
}

SurfaceTruth surface_truth(const World& world, EntityId first, EntityId second, WorldTime t) {
  return surface_truth(SurfacePair(world, first, second, t));
}

}  // namespace rtstdb::oracle
