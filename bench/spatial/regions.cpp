#include "bench/spatial/regions.hpp"

#include <algorithm>

#include "bench/spatial/boost_tree.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t ids_per_region = 192;
/// Two boxes this near to touching may be told apart by rounding alone: single precision at 50 m.
constexpr double touching_m = 2e-5;

rtstdb::Bounds around(const glm::dvec3& center_m, const glm::dvec3& half_m) {
  return {glm::vec3(center_m - half_m), glm::vec3(center_m + half_m)};
}

/// Of upright boxes: how far they are apart, or negative, how deep they lie in each other.
double gap_m(const rtstdb::Bounds& a, const rtstdb::Bounds& b) {
  const glm::dvec3 gaps = glm::max(glm::dvec3(a.minimum_m) - glm::dvec3(b.maximum_m),
                                   glm::dvec3(b.minimum_m) - glm::dvec3(a.maximum_m));
  return std::max({gaps.x, gaps.y, gaps.z});
}

void demand_same(std::span<const rtstdb::RegionAnswer> ours, PeerRegions& theirs,
                 std::span<const rtstdb::Bounds> boxes, std::span<const rtstdb::Bounds> queries) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    std::vector<std::uint32_t> our_ids, different;
    for (const rtstdb::EntityId id : ours[i].entities)
      our_ids.push_back(id.index);
    const auto their_ids = std::span(theirs.ids).subspan(i * theirs.ids_per_query, theirs.counts[i]);
    std::ranges::sort(their_ids);
    std::ranges::set_symmetric_difference(our_ids, their_ids, std::back_inserter(different));
    for (const std::uint32_t entity : different) {
      if (std::abs(gap_m(boxes[entity], queries[i])) <= touching_m) continue;
      throw std::runtime_error("region_box_entities: region " + std::to_string(i) +
                               " is answered otherwise by the peer, for entity " + std::to_string(entity));
    }
    found += our_ids.size();
  }
  const double mean = static_cast<double>(found) / static_cast<double>(queries.size());
  if (mean < 30.0 || mean > 70.0)
    throw std::runtime_error("region_box_entities: a region finds " + std::to_string(mean) + " on average");
}

}  // namespace

std::vector<Figure> measure_regions(const SpatialOptions& options) {
  const std::uint32_t entity_count = options.tiny ? 1000 : 100'000;
  const std::uint32_t region_count = options.tiny ? 256 : 1u << 15;
  const float half_m = options.tiny ? 11.0f : 50.0f;

  OurWorld world(entity_count);
  const rtstdb::GeometryId box = world.add(rtstdb::make_box(glm::dvec3(1.0)));
  std::vector<rtstdb::EntityRow> rows = strewn_boxes(entity_count, half_m, 5);
  std::vector<rtstdb::Bounds> boxes, queries;
  for (rtstdb::EntityRow& row : rows) {
    row.geometry = box;
    boxes.push_back(around(row.motion.p_world_m, 0.5 * row.scale));
  }
  world.create(rows);

  auto query = must(world.database().prepare(rtstdb::RegionQueryOptions{
      .name = "bench", .capacity = region_count, .ids_per_region = ids_per_region}));
  Random random(6);
  for (rtstdb::Region& region : query->regions()) {
    region.center_m = random.in_box(glm::vec3(half_m - 4.0f));
    region.half_extent_m = glm::vec3(3.5f) + random.in_box(glm::vec3(0.75f));
    queries.push_back(around(glm::dvec3(region.center_m), glm::dvec3(region.half_extent_m)));
  }
  Asked<rtstdb::RegionQuery> ours(world.database(), std::move(query), region_count);
  const BoostTree peer(boxes);
  PeerRegions theirs(region_count, ids_per_region);
  const auto run_peer = [&] { peer.intersecting(queries, theirs); };

  ours.run();
  run_peer();
  demand_same(ours.query().answers(), theirs, boxes, queries);
  return rates({"region_box_entities", kilo_queries, region_count, options.tiny ? 1 : 9,
                [&] { return ours.run(); }, BoostTree::version(), run_peer});
}

}  // namespace hil::bench
