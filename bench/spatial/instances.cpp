#include "bench/spatial/instances.hpp"

#include <glm/gtc/quaternion.hpp>

#include <algorithm>

#include "bench/spatial/embree_instances.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/ray_agreement.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

constexpr std::int64_t window_ns = 100'000'000;
/// Single precision at coordinates of 50 m, and what Embree's short series for sine and cosine leave out.
constexpr double sideways_m = 2e-5;

/// The ray in the frame of the entity that it hit, where lambda is the same.
double doubt_in_entity(const MovingBodies& bodies, const rtstdb::Ray& ray, const JudgedHit& claimed,
                       double aside_m) {
  const rtstdb::EntityRow& row = bodies.rows[claimed.instance];
  const rtstdb::Pose pose = rtstdb::pose_at(row.motion, ray.t);
  const glm::dquat into = glm::conjugate(pose.q_world);
  const PreciseRay world = precise(ray);
  const PreciseRay local{(into * (world.origin_m - pose.p_world_m)) / row.scale,
                         (into * world.direction) / row.scale};
  const double smallest_scale = std::min({row.scale.x, row.scale.y, row.scale.z});
  return lambda_doubt(bodies.meshes[row.geometry.index], claimed.triangle, local, aside_m / smallest_scale);
}

}  // namespace

std::vector<Figure> measure_instances(const SuiteOptions& options) {
  const std::string name = "ray_moving_instances";
  const int rounds = options.tiny ? 1 : 9;
  const std::uint32_t ray_count = options.tiny ? 4096 : 1u << 19;
  const float half_m = options.tiny ? 8.0f : 50.0f;
  const MovingBodies bodies = moving_bodies(options.tiny ? 100 : 10'000, half_m, 3);
  const auto rays = timed_rays(ray_count, half_m, options.tiny ? 8.0f : 40.0f, window_ns, 4);

  OurWorld world(static_cast<std::uint32_t>(bodies.rows.size()));
  for (const rtstdb::TriangleMesh& mesh : bodies.meshes)
    world.add(mesh);
  world.create(bodies.rows);
  const EmbreeInstances peer(bodies.meshes, bodies.rows,
                             {rtstdb::world_time_ns(0), rtstdb::world_time_ns(window_ns)});

  auto ours = ask_rays(world, rays, rtstdb::RayMode::closest);
  std::vector<PeerHit> theirs(rays.size());
  const auto run_peer = [&] { peer.closest(rays, theirs); };
  ours.run();
  run_peer();
  demand_same_closest({name, sideways_m,
                       [&](std::size_t ray, const JudgedHit& claimed, double aside_m) {
                         return doubt_in_entity(bodies, rays[ray], claimed, aside_m);
                       }},
                      ours.query().hits(), theirs);

  return rates(
      {name, mega_rays, rays.size(), rounds, [&] { return ours.run(); }, embree_version(), run_peer});
}

}  // namespace hil::bench
