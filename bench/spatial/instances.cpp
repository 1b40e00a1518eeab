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
/// Rounding of single precision at coordinates of 50 m, and of Embree's short series for sine and cosine.
constexpr double sideways_m = 2e-5;

/// The ray in the frame of the entity that it hit; lambda is the same.
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

/// A scan from the centre, row after row, while the window passes.
std::vector<rtstdb::Ray> scan(std::uint32_t width, std::uint32_t height, float lambda_max) {
  std::vector<rtstdb::Ray> rays = camera_rays(width, height);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i].origin_m = {};
    rays[i].lambda_max = lambda_max;
    rays[i].t = rtstdb::world_time_ns(window_ns * static_cast<std::int64_t>(i) /
                                      static_cast<std::int64_t>(rays.size()));
  }
  return rays;
}

struct Question {
  std::string name;
  std::vector<rtstdb::Ray> rays;
};

}  // namespace

std::vector<Figure> measure_instances(const SuiteOptions& options) {
  const int rounds = options.tiny ? 1 : 9;
  const std::uint32_t width = options.tiny ? 64 : 1024;
  const std::uint32_t height = options.tiny ? 64 : 512;
  const float half_m = options.tiny ? 8.0f : 50.0f;
  const float reach_m = options.tiny ? 8.0f : 40.0f;
  const MovingBodies bodies = moving_bodies(options.tiny ? 100 : 10'000, half_m, 3);

  OurWorld world(static_cast<std::uint32_t>(bodies.rows.size()));
  for (const rtstdb::TriangleMesh& mesh : bodies.meshes)
    world.add(mesh);
  world.create(bodies.rows);
  const EmbreeInstances peer(bodies.meshes, bodies.rows,
                             {rtstdb::world_time_ns(0), rtstdb::world_time_ns(window_ns)});

  const Question questions[] = {
      {"ray_moving_instances", timed_rays(width * height, half_m, reach_m, window_ns, 4)},
      {"ray_moving_instances_scan", scan(width, height, reach_m)}};
  std::vector<Figure> figures;
  for (const Question& question : questions) {
    const std::vector<rtstdb::Ray>& rays = question.rays;
    auto ours = prepare_rays(world, rays, rtstdb::RayMode::closest);
    std::vector<PeerHit> theirs(rays.size());
    const auto run_peer = [&] { peer.closest(rays, theirs); };
    ours.run();
    run_peer();
    demand_same_closest({question.name, sideways_m,
                         [&](std::size_t ray, const JudgedHit& claimed, double aside_m) {
                           return doubt_in_entity(bodies, rays[ray], claimed, aside_m);
                         }},
                        ours.query().hits(), theirs);
    for (Figure& figure : rates({question.name, mega_rays, rays.size(), rounds, [&] { return ours.run(); },
                                 embree_version(), run_peer}))
      figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace hil::bench
