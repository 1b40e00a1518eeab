#include "bench/images/first_hits.hpp"

#include <random>
#include <stdexcept>
#include <string>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

PreparedBatch<rtstdb::ImageQuery> prepare_image(OurWorld& world, std::uint32_t width, std::uint32_t height,
                                                rtstdb::FirstHits first_hits) {
  auto query = must(world.database().prepare(
      rtstdb::ImageQueryOptions{.name = "first hits",
                                .width = width,
                                .height = height,
                                .outputs = {.srgb = false, .depth = true, .identity = true},
                                .first_hits = first_hits}));
  query->cameras()[0] = {.p_m = {-30.0f, 0.0f, 0.0f}};
  return {world.database(), std::move(query), 1};
}

/// Hits may differ beside silhouettes alone.
void demand_same(const rtstdb::Image& drawn, const rtstdb::Image& traced) {
  std::size_t differ = 0;
  for (std::size_t i = 0; i < drawn.entities.size(); ++i)
    differ += drawn.entities[i] != traced.entities[i] ? 1 : 0;
  if (differ * 100 > drawn.entities.size())
    throw std::runtime_error("first_hits: " + std::to_string(differ) + " of " +
                             std::to_string(drawn.entities.size()) + " pixels differ");
}

}  // namespace

std::vector<Figure> measure_first_hits(const SuiteOptions& options) {
  const std::uint32_t width = options.tiny ? 64 : 640, height = options.tiny ? 48 : 480;
  OurWorld world(1024);
  const rtstdb::GeometryId body = world.add(rtstdb::make_sphere(1.0, 3));
  const rtstdb::GeometryId wall = world.add(rtstdb::make_box({1.0, 100.0, 100.0}));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-12.0, 12.0);
  std::vector<rtstdb::EntityRow> rows(200);
  for (rtstdb::EntityRow& row : rows) {
    row.geometry = body;
    row.motion.p_world_m = {place(random), place(random), place(random)};
  }
  rows.push_back({.geometry = wall});
  rows.back().motion.p_world_m = {30.0, 0.0, 0.0};
  world.create(rows);
  auto drawn = prepare_image(world, width, height, rtstdb::FirstHits::rasterised);
  auto traced = prepare_image(world, width, height, rtstdb::FirstHits::traced);
  drawn.run();
  traced.run();
  demand_same(drawn.query().images()[0], traced.query().images()[0]);
  const RoundTimes times = in_turns(
      options.tiny ? 1 : 15, [&] { drawn.run(); }, [&] { traced.run(); });
  return {time_figure("raster_over_ray_first_hits", times, "the same image, traced")};
}

}  // namespace hil::bench
