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
#include "rtstdb/oracle/oracle.hpp"

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
    const std::size_t column = i % 100, line = i / 100;
    const glm::dvec3 p_m(10.0 * static_cast<double>(column), 10.0 * static_cast<double>(line), 0.0);
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

/// How many of the first pairs the oracle judges, each with every edge of both bodies.
constexpr std::size_t judged_pairs = 1000;

/// FCL's depths come from portal refinement, which ends in the direction of the centres: they may be larger
/// than the least depth, so only smaller ones are wrong.
bool is_right(const PeerContact& found, const rtstdb::oracle::PairTruth& truth) {
  const double tolerance_m = truth.depth_tolerance_m() + 1e-3 * std::abs(truth.distance_m);
  if (std::abs(truth.distance_m) <= truth.precision_m) return true;
  if (found.touches != (truth.distance_m < 0.0)) return false;
  return found.touches ? found.distance_m < truth.distance_m + tolerance_m
                       : std::abs(found.distance_m - truth.distance_m) < tolerance_m;
}

/// Counts the pairs of which the oracle says that the answer is right. Throws if one of ours is not.
Figure count_right(OurWorld& ours, const Scene& scene, std::span<const rtstdb::EntityId> bodies,
                   rtstdb::ContactQuery& query, std::span<const PeerContact> theirs) {
  std::vector<const rtstdb::TriangleMesh*> meshes;
  for (const rtstdb::TriangleMesh& mesh : scene.meshes)
    meshes.push_back(&mesh);
  const rtstdb::oracle::World world(must(ours.database().snapshot({})), meshes);
  const std::size_t count = std::min(judged_pairs, theirs.size());
  std::size_t theirs_right = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const rtstdb::oracle::PairTruth truth =
        rtstdb::oracle::pair_truth(world, bodies[2 * i], bodies[2 * i + 1], {});
    const auto judgement =
        rtstdb::oracle::compare(world, query.searches()[i], truth, query.answers()[i].pairs[0]);
    if (judgement.verdict == rtstdb::oracle::Verdict::differs)
      throw std::runtime_error("pair " + std::to_string(i) + ": " + judgement.reason);
    if (is_right(theirs[i], truth)) ++theirs_right;
  }
  Figure figure;
  figure.name = "narrow_convex_right";
  figure.ours = static_cast<double>(count);
  figure.unit = "of " + std::to_string(count) + " pairs";
  figure.peer = fcl_version();
  figure.theirs = static_cast<double>(theirs_right);
  figure.samples = count;
  return figure;
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
  const Figure right = count_right(world, scene, bodies, all.query(), theirs);
  std::vector<Figure> figures = rates({.name = "narrow_convex_10k",
                                       .unit = {1e3, "kpair/s"},
                                       .things = pairs,
                                       .rounds = options.tiny ? 1 : 7,
                                       .ours = [&] { return all.run(); },
                                       .peer = fcl_version() + ", collide and distance",
                                       .theirs = [&] { fcl.find(theirs); }});
  figures.push_back(right);
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
