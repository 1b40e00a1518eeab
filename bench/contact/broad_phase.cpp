#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <random>

#include "bench/contact/contacts.hpp"
#include "bench/contact/fcl_bodies.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

/// A body with the bounds of a unit cube. It is open, so it has no convex parts, and the query searches the
/// triangles of one pair alone: it leaves the other pairs undecided, and its answer truncated.
rtstdb::TriangleMesh open_cube() {
  rtstdb::TriangleMesh mesh = rtstdb::make_box({1.0, 1.0, 1.0});
  mesh.triangles.pop_back();
  return mesh;
}

}  // namespace

std::vector<Figure> measure_broad_phase(const SuiteOptions& options) {
  const std::uint32_t count = options.tiny ? 300 : 10'000;
  std::mt19937_64 engine(6);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto vector = [&] { return glm::dvec3(normal(engine), normal(engine), normal(engine)); };
  const double edge_m = 2.2 * std::cbrt(count);
  std::vector<rtstdb::EntityRow> rows(count);
  for (rtstdb::EntityRow& row : rows) {
    row.geometry = {0};
    row.motion.p_world_m = edge_m * glm::dvec3(uniform(engine), uniform(engine), uniform(engine));
    row.motion.q_world = glm::angleAxis(6.28 * uniform(engine), glm::normalize(vector()));
    row.motion.v_world_mps = 5.0 * vector();
    row.motion.w_world_radps = vector();
  }
  OurWorld world(count);
  const rtstdb::TriangleMesh mesh = open_cube();
  world.add(mesh);
  world.create(rows);
  auto prepared = must(world.database().prepare(rtstdb::ContactQueryOptions{.name = "bodies",
                                                                            .capacity = 1,
                                                                            .pairs_per_search = 65536,
                                                                            .max_bodies = count,
                                                                            .max_surface_pairs = 1}));
  PreparedBatch<rtstdb::ContactQuery> ours(world.database(), std::move(prepared), 1,
                                           rtstdb::Status::truncated);
  FclTree fcl(rtstdb::bounds_of(mesh), rows);
  int step = 0;
  const auto next_time = [&] { return rtstdb::world_time_ns(10'000'000LL * ++step); };
  const auto run_ours = [&](rtstdb::WorldTime t) {
    ours.query().searches()[0].t = t;
    return ours.run();
  };
  const rtstdb::WorldTime t = next_time();
  run_ours(t);
  const std::size_t theirs = fcl.overlapping_pairs(t);
  const std::size_t found = ours.query().answers()[0].found;
  if (found < theirs || found > theirs + theirs / 100 + 2)
    throw std::runtime_error("broad_10k: " + std::to_string(found) + " pairs, and FCL has " +
                             std::to_string(theirs));
  return rates({.name = "broad_10k",
                .unit = {1e3, "kbody/s"},
                .things = count,
                .rounds = options.tiny ? 1 : 9,
                .ours = [&] { return run_ours(next_time()); },
                .peer = fcl_version() + ", dynamic tree of boxes",
                .theirs = [&] { fcl.overlapping_pairs(next_time()); }});
}

}  // namespace hil::bench
