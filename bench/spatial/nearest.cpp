#include "bench/spatial/nearest.hpp"

#include <cmath>

#include "bench/spatial/embree_hit.hpp"
#include "bench/spatial/embree_nearest.hpp"
#include "bench/spatial/nanoflann_tree.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

/// Rounding of single precision at a few metres, and at 50 m.
constexpr double triangle_tolerance_m = 2e-6;
constexpr double center_tolerance_m = 2e-5;

std::vector<glm::vec3> points_in(std::uint32_t count, float half_m, std::uint64_t seed) {
  Random random(seed);
  std::vector<glm::vec3> points_m(count);
  for (glm::vec3& point_m : points_m)
    point_m = random.in_box(glm::vec3(half_m));
  return points_m;
}

PreparedBatch<rtstdb::NearestQuery> prepare_nearest(OurWorld& world, std::span<const glm::vec3> points_m,
                                                    rtstdb::NearestTarget target, std::uint32_t k) {
  const auto count = static_cast<std::uint32_t>(points_m.size());
  auto query = must(world.database().prepare(
      rtstdb::NearestQueryOptions{.name = "bench", .capacity = count, .target = target, .k = k}));
  for (std::uint32_t i = 0; i < count; ++i)
    query->points()[i].point_m = points_m[i];
  return {world.database(), std::move(query), count};
}

/// Ties may be broken differently, so only distances are compared.
void demand_same(const std::string& name, std::size_t point, const rtstdb::NearestAnswer& ours,
                 std::span<const float> theirs_m, double tolerance_m) {
  bool same = !ours.incomplete && ours.neighbors.size() == theirs_m.size();
  for (std::size_t i = 0; same && i < theirs_m.size(); ++i) {
    const double apart_m =
        std::abs(static_cast<double>(ours.neighbors[i].distance_m) - static_cast<double>(theirs_m[i]));
    same = apart_m <= tolerance_m;
  }
  if (!same)
    throw std::runtime_error(name + ": point " + std::to_string(point) +
                             " is answered otherwise by the peer");
}

std::vector<Figure> measure_triangle(const SuiteOptions& options) {
  const std::string name = "nearest_triangle_k1";
  const rtstdb::TriangleMesh mesh = options.tiny ? lumpy_body(33, 32, 1) : lumpy_body(257, 256, 1);
  const auto points_m = points_in(options.tiny ? 512 : 1u << 17, 1.5f, 12);
  OurWorld world(1);
  rtstdb::EntityRow row;
  row.geometry = world.add(mesh);
  world.create({&row, 1});
  auto ours = prepare_nearest(world, points_m, rtstdb::NearestTarget::triangle, 1);
  const EmbreeNearest peer(mesh);
  std::vector<PeerNearest> theirs(points_m.size());
  const auto run_peer = [&] { peer.nearest(points_m, theirs); };
  ours.run();
  run_peer();
  for (std::size_t i = 0; i < points_m.size(); ++i)
    demand_same(name, i, ours.query().answers()[i], {&theirs[i].distance_m, 1}, triangle_tolerance_m);
  return rates({name, kilo_queries, points_m.size(), options.tiny ? 1 : 9, [&] { return ours.run(); },
                embree_version(), run_peer});
}

std::vector<Figure> measure_entities(const SuiteOptions& options) {
  const std::string name = "nearest_entity_k8";
  constexpr std::size_t k = 8;
  const std::uint32_t count = options.tiny ? 500 : 100'000;
  const float half_m = options.tiny ? 9.0f : 50.0f;
  const auto points_m = points_in(options.tiny ? 512 : 1u << 17, half_m, 13);
  std::vector<rtstdb::EntityRow> rows = strewn_boxes(count, half_m, 5);
  std::vector<glm::vec3> centers_m;
  OurWorld world(count);
  const rtstdb::GeometryId box = world.add(rtstdb::make_box(glm::dvec3(1.0)));
  for (rtstdb::EntityRow& row : rows) {
    row.geometry = box;
    centers_m.emplace_back(row.motion.p_world_m);
  }
  world.create(rows);
  auto ours = prepare_nearest(world, points_m, rtstdb::NearestTarget::center, k);
  const NanoflannTree peer(centers_m);
  std::vector<std::uint32_t> numbers(k * points_m.size());
  std::vector<float> squared_m2(k * points_m.size()), distances_m(k);
  const auto run_peer = [&] { peer.nearest(points_m, k, numbers, squared_m2); };
  ours.run();
  run_peer();
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    for (std::size_t j = 0; j < k; ++j)
      distances_m[j] = std::sqrt(squared_m2[i * k + j]);
    demand_same(name, i, ours.query().answers()[i], distances_m, center_tolerance_m);
  }
  return rates({name, kilo_queries, points_m.size(), options.tiny ? 1 : 9, [&] { return ours.run(); },
                NanoflannTree::version(), run_peer});
}

}  // namespace

std::vector<Figure> measure_nearest(const SuiteOptions& options) {
  std::vector<Figure> figures = measure_triangle(options);
  for (Figure& figure : measure_entities(options))
    figures.push_back(std::move(figure));
  return figures;
}

}  // namespace hil::bench
