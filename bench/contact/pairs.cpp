#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <random>

#include "bench/contact/contacts.hpp"
#include "bench/contact/fcl_bodies.hpp"
#include "bench/contact/random_hulls.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

struct Scene {
  std::vector<rtstdb::TriangleMesh> meshes;
  std::vector<rtstdb::EntityRow> rows;  ///< two for each pair
};

/// Pairs that are apart from all others; about half of them touch.
Scene make_scene(std::size_t pairs) {
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> uniform;
  Scene scene{.meshes = random_hulls(engine), .rows = {}};
  for (std::size_t i = 0; i < pairs; ++i) {
    const glm::dvec3 p_m(10.0 * static_cast<double>(i % 100), 10.0 * static_cast<double>(i / 100), 0.0);
    for (int k = 0; k < 2; ++k) {
      rtstdb::EntityRow& row = scene.rows.emplace_back();
      row.geometry = {static_cast<std::uint32_t>(engine() % hull_count)};
      const double apart_m = k == 0 ? 0.0 : 0.6 + 0.9 * uniform(engine);
      row.motion.p_world_m = p_m + apart_m * random_direction(engine);
      row.motion.q_world = glm::angleAxis(6.28 * uniform(engine), random_direction(engine));
    }
  }
  return scene;
}

using PreparedContacts = PreparedBatch<rtstdb::ContactQuery>;

PreparedContacts prepare_pairs(OurWorld& world, std::span<const rtstdb::EntityId> bodies) {
  const auto pairs = static_cast<std::uint32_t>(bodies.size() / 2);
  auto query = must(world.database().prepare(rtstdb::ContactQueryOptions{
      .name = "pairs", .capacity = pairs, .pairs_per_search = 1, .max_bodies = 1}));
  for (std::uint32_t i = 0; i < pairs; ++i) {
    query->searches()[i].first = bodies[2 * i];
    query->searches()[i].second = bodies[2 * i + 1];
  }
  return {world.database(), std::move(query), pairs};
}

/// Both agree on whether bodies touch and on the distances of those that are apart. FCL's depths come from
/// portal refinement, which ends in the direction of the centres: they may be larger than the least depth,
/// but not smaller. Of a hundred pairs one may differ.
void demand_equal(std::span<const rtstdb::ContactAnswer> ours, std::span<const PeerContact> theirs) {
  std::size_t different = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const auto distance_m = static_cast<double>(ours[i].pairs[0].distance_m);
    const double tolerance_m = 1e-3 + 0.01 * std::abs(distance_m);
    const bool agrees = theirs[i].touches
                            ? theirs[i].distance_m < distance_m + tolerance_m && distance_m < 1e-4
                            : std::abs(distance_m - theirs[i].distance_m) < tolerance_m;
    different += agrees ? 0 : 1;
  }
  if (different * 100 > ours.size())
    throw std::runtime_error("narrow_convex: " + std::to_string(different) + " of " +
                             std::to_string(ours.size()) + " pairs differ from FCL's");
}

}  // namespace

std::vector<Figure> measure_pairs(const SuiteOptions& options) {
  const std::size_t pairs = options.tiny ? 200 : 10'000;
  const Scene scene = make_scene(pairs);
  OurWorld world(static_cast<std::uint32_t>(2 * pairs), hull_count);
  for (const rtstdb::TriangleMesh& mesh : scene.meshes)
    world.add(mesh);
  const std::vector<rtstdb::EntityId> bodies = world.create(scene.rows);
  PreparedContacts all = prepare_pairs(world, bodies);
  const FclPairs fcl(scene.meshes, scene.rows);
  std::vector<PeerContact> theirs;
  all.run();
  fcl.find(theirs);
  demand_equal(all.query().answers(), theirs);
  std::vector<Figure> figures = rates({.name = "narrow_convex_10k",
                                       .unit = {1e3, "kpair/s"},
                                       .things = pairs,
                                       .rounds = options.tiny ? 1 : 7,
                                       .ours = [&] { return all.run(); },
                                       .peer = fcl_version() + ", collide and distance",
                                       .theirs = [&] { fcl.find(theirs); }});
  PreparedContacts few = prepare_pairs(world, std::span(bodies).first(32));
  std::vector<double> micros;
  for (int i = 0; i < (options.tiny ? 20 : 2000); ++i)
    micros.push_back(1e6 * seconds_of([&] { few.run(); }));
  for (const auto& [name, share] :
       {std::pair("contact_16_pairs_p50", 0.5), std::pair("contact_16_pairs_p99", 0.99)}) {
    Figure& figure = figures.emplace_back();
    figure.name = name;
    figure.ours = quantile(micros, share);
    figure.unit = "us";
    figure.samples = micros.size();
  }
  return figures;
}

}  // namespace hil::bench
