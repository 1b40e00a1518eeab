#include "bench/images/path_tracer.hpp"

#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <string>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t bounces = 2;
constexpr glm::vec3 lamp_m{0.0f, 0.0f, 4.0f};

/// A closed box with bodies in it, so that no path leaves it.
void fill_scene(OurWorld& world) {
  const rtstdb::GeometryId walls = world.add(rtstdb::make_box({12.0, 12.0, 10.0}));
  const rtstdb::GeometryId body = world.add(rtstdb::make_sphere(0.6, 4));
  const rtstdb::MaterialId matt =
      must(world.database().add_material({.base_color = glm::dvec3(0.7), .refractive_index = 1.0}, "matt"));
  const rtstdb::LightId lamp =
      must(world.database().add_light({.kind = rtstdb::LightKind::point, .intensity_cd = 1000.0}, "lamp"));
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  std::vector<rtstdb::EntityRow> rows(60);
  for (rtstdb::EntityRow& row : rows) {
    row.geometry = body;
    row.material = matt;
    row.motion.p_world_m = {place(random), place(random), 0.7 * place(random)};
  }
  rows.push_back({.geometry = walls, .material = matt});
  rows.push_back({.light = lamp});
  rows.back().motion.p_world_m = glm::dvec3(lamp_m);
  world.create(rows);
}

/// Rays like those of the path tracer: of each bounce, and to the lamp.
struct LikeRays {
  std::vector<std::vector<rtstdb::Ray>> closest;
  std::vector<std::vector<rtstdb::Ray>> shadow;
  std::size_t count() const {
    std::size_t all = 0;
    for (const auto* rays : {&closest, &shadow})
      for (const auto& of_bounce : *rays)
        all += of_bounce.size();
    return all;
  }
};

glm::vec3 scattered(const glm::vec3& n, std::mt19937& random) {
  std::uniform_real_distribution<float> share(0.0f, 1.0f);
  const float z = 2.0f * share(random) - 1.0f;
  const float angle = 2.0f * std::numbers::pi_v<float> * share(random);
  const float across = std::sqrt(1.0f - z * z);
  return n + 0.999f * glm::vec3(across * std::cos(angle), across * std::sin(angle), z);
}

LikeRays rays_like(OurWorld& world, const rtstdb::Camera& camera, std::uint32_t width, std::uint32_t height) {
  LikeRays like;
  std::vector<rtstdb::Ray> rays;
  // In tiles, as the path tracer has them.
  constexpr std::uint32_t side = 16;
  for (std::uint32_t top = 0; top < height; top += side)
    for (std::uint32_t left = 0; left < width; left += side)
      for (std::uint32_t i = 0; i < side * side; ++i)
        rays.push_back(rtstdb::pixel_ray(camera, width, height, left + i % side, top + i / side));
  std::mt19937 random(5);
  for (std::uint32_t bounce = 0; bounce <= bounces; ++bounce) {
    auto batch = prepare_rays(world, rays, rtstdb::RayMode::closest);
    batch.run();
    const auto hits = batch.query().hits();
    like.closest.push_back(rays);
    if (bounce == bounces) break;
    std::vector<rtstdb::Ray> next, shadow;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i].status != rtstdb::HitStatus::hit) continue;
      const glm::vec3 n =
          glm::dot(hits[i].n_world, rays[i].direction) > 0.0f ? -hits[i].n_world : hits[i].n_world;
      rtstdb::Ray ray;
      ray.origin_m = rays[i].origin_m + hits[i].lambda * rays[i].direction + 1e-4f * n;
      ray.direction = scattered(n, random);
      next.push_back(ray);
      ray.direction = lamp_m - ray.origin_m;
      ray.lambda_max = 0.9999f;
      if (glm::dot(ray.direction, n) > 0.0f) shadow.push_back(ray);
    }
    like.shadow.push_back(shadow);
    rays = next;
  }
  return like;
}

}  // namespace

std::vector<Figure> measure_path_tracer(const SuiteOptions& options) {
  const std::uint32_t width = options.tiny ? 32 : 512, height = options.tiny ? 32 : 384;
  OurWorld world(1024);
  fill_scene(world);
  const rtstdb::Camera camera{.p_m = {-5.5f, 0.0f, 0.0f}, .horizontal_angle_rad = 1.4f};
  const LikeRays like = rays_like(world, camera, width, height);
  std::vector<PreparedBatch<rtstdb::RayQuery>> batches;
  for (const auto& rays : like.closest)
    batches.push_back(prepare_rays(world, rays, rtstdb::RayMode::closest));
  for (const auto& rays : like.shadow)
    batches.push_back(prepare_rays(world, rays, rtstdb::RayMode::any));
  auto query = must(world.database().prepare(rtstdb::ImageQueryOptions{
      .name = "paths", .width = width, .height = height, .samples_per_pixel = 1, .bounces = bounces}));
  query->cameras()[0] = camera;
  PreparedBatch<rtstdb::ImageQuery> image(world.database(), std::move(query), 1);
  const auto trace_all = [&] {
    for (auto& batch : batches)
      batch.run();
  };
  const RoundTimes times = in_turns(
      options.tiny ? 1 : 9, [&] { image.run(); }, trace_all);
  const double mega = static_cast<double>(like.count()) * 1e-6;
  return {{.name = "path_tracer_rays",
           .ours = mega / median(times.ours_s),
           .unit = "Mray/s",
           .peer = "like rays as queries",
           .theirs = mega / median(times.theirs_s),
           .better = Better::higher,
           .samples = times.ours_s.size()}};
}

}  // namespace hil::bench
