#include "bench/spatial/regions.hpp"

#include <algorithm>

#include "bench/spatial/boost_tree.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t ids_per_region = 192;
/// Rounding may decide whether boxes this near to touching do touch: single precision at 50 m.
constexpr double touching_m = 2e-5;
/// The same for a triangle and a box at a metre.
constexpr float touching_triangle_m = 2e-6f;

rtstdb::Bounds around(const glm::dvec3& center_m, const glm::dvec3& half_m) {
  return {glm::vec3(center_m - half_m), glm::vec3(center_m + half_m)};
}

/// The distance of two axis-aligned boxes; negative: their penetration depth.
double gap_m(const rtstdb::Bounds& a, const rtstdb::Bounds& b) {
  const glm::dvec3 gaps = glm::max(glm::dvec3(a.minimum_m) - glm::dvec3(b.maximum_m),
                                   glm::dvec3(b.minimum_m) - glm::dvec3(a.maximum_m));
  return std::max({gaps.x, gaps.y, gaps.z});
}

std::uint32_t number_of(const rtstdb::EntityId& id) {
  return id.index;
}
std::uint32_t number_of(const rtstdb::EntityTriangle& one) {
  return one.triangle;
}

/// `listed` selects what is compared. `in_doubt(region, number)`: rounding may decide about this element.
template <class Listed, class InDoubt>
void demand_same(const std::string& name, std::span<const rtstdb::RegionAnswer> ours, PeerRegions& theirs,
                 Listed listed, InDoubt in_doubt) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    std::vector<std::uint32_t> our_numbers, different;
    for (const auto& one : ours[i].*listed)
      our_numbers.push_back(number_of(one));
    if (theirs.counts[i] > theirs.ids_per_query)
      throw std::runtime_error(name + ": more than the peer has room for");
    const auto their_numbers = std::span(theirs.ids).subspan(i * theirs.ids_per_query, theirs.counts[i]);
    std::ranges::sort(their_numbers);
    std::ranges::set_symmetric_difference(our_numbers, their_numbers, std::back_inserter(different));
    for (const std::uint32_t number : different) {
      if (in_doubt(i, number)) continue;
      throw std::runtime_error(name + ": region " + std::to_string(i) +
                               " is answered otherwise by the peer, for " + std::to_string(number));
    }
    found += our_numbers.size();
  }
  const double mean = static_cast<double>(found) / static_cast<double>(ours.size());
  if (mean < 30.0 || mean > 70.0)
    throw std::runtime_error(name + ": a region finds " + std::to_string(mean) + " on average");
}

std::vector<Figure> measure_entities(const SuiteOptions& options) {
  const std::string name = "region_box_entities";
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
  PreparedBatch<rtstdb::RegionQuery> ours(world.database(), std::move(query), region_count);
  const BoostTree peer(boxes);
  PeerRegions theirs(region_count, ids_per_region);
  const auto run_peer = [&] { peer.intersecting(queries, theirs); };

  ours.run();
  run_peer();
  demand_same(name, ours.query().answers(), theirs, &rtstdb::RegionAnswer::entities,
              [&](std::size_t region, std::uint32_t entity) {
                return std::abs(gap_m(boxes[entity], queries[region])) <= touching_m;
              });
  return rates({name, kilo_queries, region_count, options.tiny ? 1 : 9, [&] { return ours.run(); },
                BoostTree::version(), run_peer});
}

rtstdb::Bounds grown(const rtstdb::Bounds& box, float by_m) {
  return {box.minimum_m - by_m, box.maximum_m + by_m};
}

std::vector<Figure> measure_triangles(const SuiteOptions& options) {
  const std::string name = "region_box_triangles";
  const rtstdb::TriangleMesh mesh = rtstdb::make_sphere(1.0, options.tiny ? 4 : 7);
  const std::uint32_t region_count = options.tiny ? 256 : 1u << 15;
  const float half_m = options.tiny ? 0.14f : 0.0175f;

  OurWorld world(1);
  rtstdb::EntityRow row;
  row.geometry = world.add(mesh);
  world.create({&row, 1});
  auto query =
      must(world.database().prepare(rtstdb::RegionQueryOptions{.name = "bench",
                                                               .capacity = region_count,
                                                               .level = rtstdb::RegionLevel::triangle,
                                                               .ids_per_region = ids_per_region}));
  // Around points of the surface.
  Random random(7);
  std::vector<rtstdb::Bounds> queries;
  for (rtstdb::Region& region : query->regions()) {
    region.center_m =
        mesh.positions_m[random.next() % mesh.positions_m.size()] + random.in_box(glm::vec3(0.25f * half_m));
    region.half_extent_m = glm::vec3(half_m) + random.in_box(glm::vec3(0.25f * half_m));
    queries.push_back(around(glm::dvec3(region.center_m), glm::dvec3(region.half_extent_m)));
  }
  PreparedBatch<rtstdb::RegionQuery> ours(world.database(), std::move(query), region_count);
  const std::vector<Corners> triangles = triangles_of(mesh);
  const BoostTree peer(boxes_around(triangles));
  PeerRegions theirs(region_count, ids_per_region);
  const auto run_peer = [&] { peer.touching(queries, triangles, theirs); };

  ours.run();
  run_peer();
  demand_same(name, ours.query().answers(), theirs, &rtstdb::RegionAnswer::triangles,
              [&](std::size_t region, std::uint32_t triangle) {
                return touches(grown(queries[region], touching_triangle_m), triangles[triangle]) &&
                       !touches(grown(queries[region], -touching_triangle_m), triangles[triangle]);
              });
  return rates({name, kilo_queries, region_count, options.tiny ? 1 : 9, [&] { return ours.run(); },
                BoostTree::version(), run_peer});
}

}  // namespace

std::vector<Figure> measure_regions(const SuiteOptions& options) {
  std::vector<Figure> figures = measure_entities(options);
  for (Figure& figure : measure_triangles(options))
    figures.push_back(std::move(figure));
  return figures;
}

}  // namespace hil::bench
