#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <random>
#include <stdexcept>
#include <string>

#include "bench/contact/contacts.hpp"
#include "bench/contact/random_hulls.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

std::vector<Figure> measure_impacts(const SuiteOptions& options) {
  const std::uint32_t pairs = options.tiny ? 50 : 1000;
  std::mt19937_64 engine(8);
  std::uniform_real_distribution<double> uniform;
  OurWorld world(2 * pairs, hull_count);
  for (const rtstdb::TriangleMesh& mesh : random_hulls(engine))
    world.add(mesh);
  std::vector<rtstdb::EntityRow> rows;
  for (std::uint32_t i = 0; i < pairs; ++i) {
    const std::uint32_t column = i % 40, line = i / 40;
    const glm::dvec3 p_m(100.0 * column, 100.0 * line, 0.0);
    const glm::dvec3 side = random_direction(engine);
    for (int k = 0; k < 2; ++k) {
      rtstdb::EntityRow& row = rows.emplace_back();
      row.geometry = {static_cast<std::uint32_t>(engine() % hull_count)};
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
  if (met < pairs - pairs / 20)
    throw std::runtime_error("time_of_impact: " + std::to_string(met) + " of " + std::to_string(pairs) +
                             " pairs meet");
  std::vector<double> rates;
  for (int i = 0; i < (options.tiny ? 1 : 9); ++i)
    rates.push_back(1e-3 * pairs / seconds_of([&] { batch.run(); }));
  Figure figure;
  figure.name = "time_of_impact_1k";
  figure.ours = median(rates);
  figure.unit = "kpair/s";
  figure.better = Better::higher;
  figure.samples = rates.size();
  return {figure};
}

}  // namespace hil::bench
