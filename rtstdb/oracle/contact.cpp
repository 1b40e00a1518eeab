#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/oracle/contact_pair.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/polyhedron.hpp"

namespace rtstdb::oracle {
namespace {

/// An entity of a search, with its bounds.
struct BoundedEntity {
  EntityId id;
  OrientedBox box;
  Polyhedron body;
  double radius_m = 0.0;  ///< of a sphere around the box, at its centre
  double noise_units = 0.0;
  std::uint32_t mask = 0;
};

BoundedEntity bounded(const World& world, const EntityState& state, WorldTime t) {
  const PosedEntity entity = posed(world, state, t, false);
  const OrientedBox box = oriented_box(entity.mesh->bounds(), state.row.scale, entity.pose);
  return {state.id,
          box,
          polyhedron_of(box),
          glm::length(box.half_extent_m),
          noise_units_m(state, entity.pose, entity.dt_s, entity.reach()),
          state.row.mask};
}

/// Whether the pair has been left out because its gap is plainly above its noise. Along one of the three axes
/// of a box, the centres are apart by at least their distance over the square root of 3.
bool is_far(const BoundedEntity& first, const BoundedEntity& second, double beyond_m) {
  const double along_axis_m = glm::distance(first.box.center_m, second.box.center_m) / std::sqrt(3.0);
  return along_axis_m - first.radius_m - second.radius_m > beyond_m;
}

void add_candidate(const BoundedEntity& first, const BoundedEntity& second, double margin_m, bool is_named,
                   std::vector<ContactCandidate>& candidates) {
  const double noise_m = noise_per_unit * (first.noise_units + second.noise_units);
  if (!is_named && is_far(first, second, std::sqrt(3.0) * margin_m + noise_m)) return;
  OrientedBox widened = first.box;
  widened.half_extent_m += margin_m;
  candidates.push_back({first.id, second.id, separation_m(polyhedron_of(widened), second.body), noise_m});
}

}  // namespace

PosedPair posed_pair(const World& world, EntityId first, EntityId second, WorldTime t) {
  const EntityState* of_first = world.find(first);
  const EntityState* of_second = world.find(second);
  RTSTDB_ASSERT(of_first != nullptr && of_second != nullptr && of_first != of_second,
                "the entities of a pair do not exist, or are one entity");
  RTSTDB_ASSERT(of_first->row.geometry.valid() && of_second->row.geometry.valid(),
                "an entity of a pair has no geometry");
  PosedPair pair{posed(world, *of_first, t, false), posed(world, *of_second, t, false), {}, {}};
  RTSTDB_ASSERT(pair.first.mesh->convex() && pair.second.mesh->convex(), "a body of a pair is not convex");
  pair.first_body = convex_body(pair.first, pair.first.pose.p_world_m);
  pair.second_body = convex_body(pair.second, pair.first.pose.p_world_m);
  return pair;
}

PosedPair posed_parts(const World& world, EntityId first, std::uint32_t first_part, EntityId second,
                      std::uint32_t second_part, WorldTime t) {
  const EntityState* of_first = world.find(first);
  const EntityState* of_second = world.find(second);
  PosedPair pair{posed(world, *of_first, t, false), posed(world, *of_second, t, false), {}, {}};
  pair.first.mesh = world.parts_of(*of_first)[first_part].tree.get();
  pair.second.mesh = world.parts_of(*of_second)[second_part].tree.get();
  pair.first_body = convex_body(pair.first, pair.first.pose.p_world_m);
  pair.second_body = convex_body(pair.second, pair.first.pose.p_world_m);
  return pair;
}

double PairTruth::depth_tolerance_m() const noexcept {
  return std::max(precision_m, -depth_relative_tolerance * distance_m);
}

PairTruth pair_truth(const PosedPair& pair) {
  const ConvexBody& first = pair.first_body;
  const ConvexBody& second = pair.second_body;
  const AxisGap gap = largest_gap(first, second);
  PairTruth truth{.distance_m = gap.gap_m,
                  .n_world = gap.axis,
                  .ulp_m = first.diagonal_m >= second.diagonal_m ? first.ulp_m : second.ulp_m};
  if (gap.gap_m > 0.0) {
    const BodyDistance apart = surface_distance(first, second);
    truth.distance_m = apart.distance_m;
    truth.p_first_m = apart.p_first_m;
    truth.p_second_m = apart.p_second_m;
    // The direction of a segment that is shorter than its rounding errors is not known.
    const double rounding_m = 1e-12 * (first.diagonal_m + second.diagonal_m);
    if (apart.distance_m > rounding_m)
      truth.n_world = (apart.p_first_m - apart.p_second_m) / apart.distance_m;
  }
  constexpr double distance_units = 8.0 * 0x1p-23;
  truth.precision_m = std::max({contact_precision * std::min(first.diagonal_m, second.diagonal_m),
                                8.0 * truth.ulp_m, distance_units * truth.distance_m});
  return truth;
}

PairTruth pair_truth(const World& world, EntityId first, EntityId second, WorldTime t) {
  return pair_truth(posed_pair(world, first, second, t));
}

std::vector<ContactCandidate> contact_candidates(const World& world, const ContactSearch& search) {
  const auto margin_m = static_cast<double>(search.margin_m);
  std::vector<ContactCandidate> candidates;
  if (search.first.valid()) {
    const EntityState* named = world.find(search.first);
    RTSTDB_ASSERT(named != nullptr && named->row.geometry.valid(),
                  "the first entity does not exist, or has no geometry");
    RTSTDB_ASSERT(search.first != search.second, "the first and the second entity are the same");
    const BoundedEntity first = bounded(world, *named, search.t);
    for (const EntityState& state : world.entities()) {
      const bool is_named = state.id == search.second;
      const bool is_admitted =
          is_named || (!search.second.valid() && &state != named && visible(state, search.second_mask));
      if (is_admitted) add_candidate(first, bounded(world, state, search.t), margin_m, is_named, candidates);
    }
    return candidates;
  }
  std::vector<BoundedEntity> entities;
  for (const EntityState& state : world.entities()) {
    if (visible(state, search.first_mask | search.second_mask))
      entities.push_back(bounded(world, state, search.t));
  }
  for (std::size_t i = 0; i < entities.size(); ++i) {
    for (std::size_t j = i + 1; j < entities.size(); ++j) {
      const std::uint32_t a = entities[i].mask;
      const std::uint32_t b = entities[j].mask;
      const bool is_admitted = ((a & search.first_mask) != 0 && (b & search.second_mask) != 0) ||
                               ((b & search.first_mask) != 0 && (a & search.second_mask) != 0);
      if (is_admitted) add_candidate(entities[i], entities[j], margin_m, false, candidates);
    }
  }
  return candidates;
}

}  // namespace rtstdb::oracle
