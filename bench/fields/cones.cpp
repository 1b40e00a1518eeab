#include "bench/fields/cones.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr float beam_rad = 0.02f / 57.29578f;

PreparedBatch<rtstdb::ConeQuery> prepare_cones(OurWorld& world, std::span<const rtstdb::Ray> axes,
                                               rtstdb::ConeQueryOptions options) {
  options.name = "cones";
  options.capacity = static_cast<std::uint32_t>(axes.size());
  auto query = must(world.database().prepare(options));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    rtstdb::Cone& cone = query->cones()[i];
    cone.origin_m = axes[i].origin_m;
    cone.direction = axes[i].direction;
    cone.opening_angle_rad = beam_rad;
    cone.lambda_max = axes[i].lambda_max;
    cone.t = axes[i].t;
  }
  return {world.database(), std::move(query), options.capacity};
}

/// So narrow a beam has nearly the hits of its axis; only next to an edge it may meet a body that the ray
/// misses.
void demand_similar(const std::string& name, std::span<const rtstdb::RayHit> rays,
                    std::span<const rtstdb::ConeReturn> cones) {
  std::size_t different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const float limit = 0.01f + 0.01f * rays[i].lambda;
    const bool same =
        rays[i].status == cones[i].status &&
        (rays[i].status != rtstdb::HitStatus::hit || std::abs(rays[i].lambda - cones[i].lambda) < limit);
    different += same ? 0 : 1;
  }
  if (different * 100 > rays.size())
    throw std::runtime_error(name + ": " + std::to_string(different) + " of " + std::to_string(rays.size()) +
                             " cones differ from the ray along their axis");
}

Figure rate_figure(const std::string& name, std::size_t count, const RoundTimes& times, const char* peer) {
  const double mega = static_cast<double>(count) * 1e-6;
  return {.name = name,
          .ours = mega / median(times.ours_s),
          .unit = "Mcone/s",
          .peer = peer,
          .theirs = mega / median(times.theirs_s),
          .better = Better::higher,
          .samples = times.ours_s.size()};
}

std::vector<Figure> measure_axes(const std::string& suffix, OurWorld& world,
                                 std::span<const rtstdb::Ray> axes, int rounds) {
  auto rays = prepare_rays(world, axes, rtstdb::RayMode::closest);
  auto exact = prepare_cones(world, axes, {});
  auto fast = prepare_cones(world, axes, {.mode = rtstdb::ConeMode::fast});
  // Fractions take much longer.
  const auto some = axes.subspan(axes.size() / 2).first(std::min<std::size_t>(axes.size() / 2, 4096));
  auto shared = prepare_cones(world, some, {.fractions = true});
  auto fast_shared = prepare_cones(world, some, {.mode = rtstdb::ConeMode::fast, .fractions = true});
  auto exact_some = prepare_cones(world, some, {});
  rays.run();
  exact.run();
  fast.run();
  demand_similar("cone_exact_vs_ray" + suffix, rays.query().hits(), exact.query().returns());
  demand_similar("cone_fast_vs_ray" + suffix, rays.query().hits(), fast.query().returns());
  const auto run_rays = [&] { rays.run(); };
  const RoundTimes of_fast = in_turns(
      rounds, [&] { fast.run(); }, run_rays);
  const RoundTimes of_exact = in_turns(
      rounds, [&] { exact.run(); }, run_rays);
  const RoundTimes of_shared = in_turns(
      rounds, [&] { shared.run(); }, [&] { exact_some.run(); });
  const RoundTimes of_fast_shared = in_turns(
      rounds, [&] { fast_shared.run(); }, [&] { exact_some.run(); });
  return {rate_figure("cone_fast_vs_ray" + suffix, axes.size(), of_fast, "closest-hit rays"),
          rate_figure("cone_exact_vs_ray" + suffix, axes.size(), of_exact, "closest-hit rays"),
          rate_figure("cone_fractions_vs_exact" + suffix, some.size(), of_shared, "exact cones"),
          rate_figure("cone_fast_fractions_vs_exact" + suffix, some.size(), of_fast_shared, "exact cones")};
}

}  // namespace

std::vector<Figure> measure_cones(const SuiteOptions& options) {
  OurWorld world(1);
  rtstdb::EntityRow row;
  row.geometry = must(world.database().add_geometry(body_in_bowl(options.tiny ? 24 : 180, 1),
                                                    "body in a bowl", {.field = rtstdb::FieldOptions{}}));
  world.create({&row, 1});
  const int rounds = options.tiny ? 1 : 5;
  std::vector<Figure> figures =
      measure_axes("", world, options.tiny ? camera_rays(32, 16) : camera_rays(512, 256), rounds);
  const auto scattered = scattered_rays(options.tiny ? 512 : 1u << 17, 3);
  for (Figure& figure : measure_axes("_scattered", world, scattered, rounds))
    figures.push_back(std::move(figure));
  return figures;
}

}  // namespace hil::bench
