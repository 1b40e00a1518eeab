#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/contact/contacts.hpp"
#include "bench/contact/random_hulls.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

/// A torus of 1,024 triangles.
rtstdb::TriangleMesh ring(double radius_m, double tube_radius_m) {
  constexpr std::uint32_t around = 32, across = 16;
  rtstdb::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t k = 0; k < across; ++k) {
      const double turn_rad = 2.0 * std::numbers::pi * i / around;
      const double tube_rad = 2.0 * std::numbers::pi * k / across;
      const double out_m = radius_m + tube_radius_m * std::cos(tube_rad);
      mesh.positions_m.emplace_back(out_m * std::cos(turn_rad), out_m * std::sin(turn_rad),
                                    tube_radius_m * std::sin(tube_rad));
      const std::uint32_t next_i = (i + 1) % around, next_k = (k + 1) % across;
      mesh.triangles.emplace_back(i * across + k, next_i * across + k, next_i * across + next_k);
      mesh.triangles.emplace_back(i * across + k, next_i * across + next_k, i * across + next_k);
    }
  }
  return mesh;
}

/// Pairs of the meshes, which lie within about a metre of the origin, that approach one another and turn. At
/// least `min_share` of them meet.
Figure measure_approaching(const SuiteOptions& options, const std::string& name,
                           const std::vector<rtstdb::TriangleMesh>& meshes, double min_share,
                           std::mt19937_64& engine) {
  const std::uint32_t pairs = options.tiny ? 50 : 1000;
  std::uniform_real_distribution<double> uniform;
  OurWorld world(2 * pairs, static_cast<std::uint32_t>(meshes.size()));
  for (const rtstdb::TriangleMesh& mesh : meshes)
    world.add(mesh);
  std::vector<rtstdb::EntityRow> rows;
  for (std::uint32_t i = 0; i < pairs; ++i) {
    const std::uint32_t column = i % 40, line = i / 40;
    const glm::dvec3 p_m(100.0 * column, 100.0 * line, 0.0);
    const glm::dvec3 side = random_direction(engine);
    for (int k = 0; k < 2; ++k) {
      rtstdb::EntityRow& row = rows.emplace_back();
      row.geometry = {static_cast<std::uint32_t>(engine() % meshes.size())};
      row.motion.p_world_m = p_m + (k == 0 ? 0.0 : 5.0 + 25.0 * uniform(engine)) * side;
      row.motion.v_world_mps = (k == 0 ? 0.0 : -5.0 - 20.0 * uniform(engine)) * side;
      row.motion.q_world = glm::angleAxis(6.28 * uniform(engine), random_direction(engine));
      row.motion.w_world_radps = random_direction(engine);
    }
  }
  const std::vector<rtstdb::EntityId> bodies = world.create(rows);
  auto query = must(world.database().prepare(
      rtstdb::ImpactQueryOptions{.name = "impacts", .capacity = pairs, .candidates_per_search = 1}));
  for (std::uint32_t i = 0; i < pairs; ++i)
    query->searches()[i] = {.first = bodies[2 * i],
                            .second = bodies[2 * i + 1],
                            .window = rtstdb::Nanoseconds(rtstdb::max_impact_window_ns)};
  PreparedBatch<rtstdb::ImpactQuery> batch(world.database(), std::move(query), pairs);
  batch.run();
  std::uint32_t met = 0;
  for (const rtstdb::ImpactAnswer& answer : batch.query().answers())
    met += answer.status == rtstdb::ImpactStatus::impact ? 1 : 0;
  if (met < min_share * pairs)
    throw std::runtime_error(name + ": " + std::to_string(met) + " of " + std::to_string(pairs) +
                             " pairs meet");
  std::vector<double> rates;
  for (int i = 0; i < (options.tiny ? 1 : 9); ++i)
    rates.push_back(1e-3 * pairs / seconds_of([&] { batch.run(); }));
  Figure figure;
  figure.name = name;
  figure.ours = median(rates);
  figure.unit = "kpair/s";
  figure.better = Better::higher;
  figure.samples = rates.size();
  return figure;
}

}  // namespace

std::vector<Figure> measure_impacts(const SuiteOptions& options) {
  std::mt19937_64 engine(8);
  const std::vector<rtstdb::TriangleMesh> hulls = random_hulls(engine);
  const std::vector<rtstdb::TriangleMesh> surfaces{ring(0.7, 0.3), ring(0.9, 0.1), ring(0.5, 0.3)};
  return {measure_approaching(options, "time_of_impact_1k", hulls, 0.95, engine),
          measure_approaching(options, "time_of_impact_surfaces_1k", surfaces, 0.6, engine)};
}

}  // namespace hil::bench
