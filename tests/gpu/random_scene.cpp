#include "tests/gpu/random_scene.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>

namespace rtstdb::test {
namespace {

WorldTime random_time(Random& random, WorldTime first, double window_s) {
  return first + Nanoseconds(static_cast<std::int64_t>(random.uniform(0.0, 1.0) * window_s * 1e9));
}

/// Random triangles, or random triangles around one center; one in six has no area.
TriangleMesh soup(Random& random, std::size_t count, bool one_center) {
  TriangleMesh mesh;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 center(one_center ? glm::dvec3(0.1, -0.2, 0.05) : 0.5 * random.vector());
    const glm::vec3 a(0.3 * random.vector());
    const glm::vec3 b(0.3 * random.vector());
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.insert(mesh.positions_m.end(), {center + a, center + b, center - a - b});
    mesh.triangles.emplace_back(first, first + 1, i % 6 == 5 ? first : first + 2);
  }
  return mesh;
}

TriangleMesh single_triangle() {
  return {{{-0.7f, -0.4f, 0.0f}, {0.7f, -0.4f, 0.1f}, {0.0f, 0.9f, -0.1f}}, {{0, 1, 2}}};
}

const EntityState& random_entity(Random& random, std::span<const EntityState> entities) {
  return entities[random.below(entities.size())];
}

glm::dvec3 axis_direction(Random& random) {
  glm::dvec3 direction(0.0);
  direction[static_cast<int>(random.below(3))] = random.one_in(2) ? 1.0 : -1.0;
  return direction;
}

}  // namespace

std::vector<TriangleMesh> mixed_meshes(Random& random) {
  return {make_box({1.0, 2.0, 1.5}), make_sphere(1.0, 0), make_sphere(0.8, 3),      make_cylinder(0.5, 2.0),
          make_rectangle(2.0, 3.0),  single_triangle(),   soup(random, 300, false), soup(random, 100, true)};
}

EntityRow random_row(Random& random, std::span<const GeometryId> geometries, const SceneOptions& options,
                     const std::vector<EntityRow>& others) {
  EntityRow row;
  row.geometry = geometries[random.below(geometries.size())];
  row.scale = {random.magnitude(0.2, 3.0), random.magnitude(0.2, 3.0), random.magnitude(0.2, 3.0)};
  row.mask = 1u << random.below(4);
  row.material = {static_cast<std::uint32_t>(random.below(scene_materials))};
  Motion& motion = row.motion;
  motion.p_world_m = options.radius_m * random.vector();
  motion.q_world = random.orientation();
  motion.valid_from = options.version_time;
  if (!others.empty() && random.one_in(10)) {
    motion.p_world_m = pose_at(others[random.below(others.size())].motion, options.version_time).p_world_m;
  }
  if (options.still || random.one_in(4)) return row;
  motion.v_world_mps = random.magnitude(0.1, 30.0) * random.direction();
  motion.w_world_radps = random.magnitude(0.1, 31.0) * random.direction();
  // The motion begins earlier and reaches the chosen pose at the version's time.
  const auto age_ns = static_cast<std::int64_t>(random.uniform(0.0, 60.0) * 1e9);
  row.motion = rebased(motion, options.version_time - Nanoseconds(age_ns));
  return row;
}

Ray random_ray(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
               WorldTime first, double window_s) {
  Ray ray;
  ray.t = random_time(random, first, window_s);
  const glm::dvec3 from_m = 2.0 * options.radius_m * random.vector();
  const glm::dvec3 target_m =
      pose_at(random_entity(random, entities).row.motion, ray.t).p_world_m + 0.6 * random.vector();
  glm::dvec3 direction = target_m - from_m;
  ray.origin_m = from_m;
  if (random.one_in(16)) {
    direction = axis_direction(random);
    ray.origin_m = target_m - 3.0 * options.radius_m * direction;
  }
  ray.direction = random.magnitude(1e-3, 1e3) * direction;
  if (random.one_in(4)) {
    const EntityState& carrier = random_entity(random, entities);
    const Pose pose = pose_at(carrier.row.motion, ray.t);
    ray.carrier = carrier.id;
    ray.origin_m = 2.0 * random.vector();
    ray.direction = glm::conjugate(pose.q_world) * (target_m - pose.p_world_m) - glm::dvec3(ray.origin_m);
  }
  if (random.one_in(4)) ray.mask = static_cast<std::uint32_t>(random.below(16));
  const double to_target = glm::length(direction) / glm::length(glm::dvec3(ray.direction));
  if (random.one_in(4)) ray.lambda_max = static_cast<float>(to_target * random.uniform(0.5, 1.5));
  if (random.one_in(4)) {
    ray.lambda_min = std::min(ray.lambda_max, static_cast<float>(to_target * random.uniform(0.0, 1.2)));
  }
  return ray;
}

std::vector<Ray> random_neighbours(Random& random, std::span<const EntityState> entities,
                                   const SceneOptions& options, WorldTime first, double window_s) {
  std::vector<Ray> rays(8, random_ray(random, entities, options, first, window_s));
  // As at the end of an image row.
  const bool is_split = random.one_in(24);
  if (is_split)
    std::fill(rays.begin() + 3, rays.end(), random_ray(random, entities, options, first, window_s));
  if (is_split && random.one_in(3)) {
    for (Ray& ray : rays)
      ray = random_ray(random, entities, options, first, window_s);
  }
  // From rays that hit one triangle to rays that hit different entities.
  const double spread_rad = random.magnitude(1e-6, 0.008);
  for (Ray& ray : rays) {
    ray.t = random_time(random, first, window_s);
    if (random.one_in(2)) ray.origin_m += glm::vec3(1e-3 * random.vector());
    const glm::dvec3 direction(ray.direction);
    if (!random.one_in(8)) ray.direction = direction + spread_rad * glm::length(direction) * random.vector();
    if (random.one_in(8)) ray.mask = static_cast<std::uint32_t>(random.below(16));
    if (random.one_in(4)) ray.lambda_max *= static_cast<float>(random.uniform(0.7, 1.0));
    ray.lambda_min = std::min(ray.lambda_min, ray.lambda_max);
  }
  return rays;
}

Cone random_cone(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                 WorldTime first, double window_s) {
  const Ray ray = random_ray(random, entities, options, first, window_s);
  Cone cone;
  cone.origin_m = ray.origin_m;
  cone.direction = ray.direction;
  cone.lambda_max = ray.lambda_max;
  cone.t = ray.t;
  cone.mask = ray.mask;
  cone.carrier = ray.carrier;
  cone.opening_angle_rad = static_cast<float>(random.magnitude(1e-4, 0.1));
  if (random.one_in(32)) cone.opening_angle_rad = static_cast<float>(random.uniform(0.1, 2.0));
  if (random.one_in(8)) cone.opening_angle_rad = 0.0f;
  return cone;
}

Camera random_camera(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s) {
  const bool rolls = random.one_in(2);
  const Ray ray = random_ray(random, entities, options, first, 0.5 * window_s);
  Camera camera;
  camera.p_m = ray.origin_m;
  camera.q = glm::quat(glm::vec3(1.0f, 0.0f, 0.0f), glm::normalize(ray.direction)) *
             glm::angleAxis(static_cast<float>(random.uniform(-3.0, 3.0)), glm::vec3(1.0f, 0.0f, 0.0f));
  camera.horizontal_angle_rad = static_cast<float>(random.magnitude(0.05, 2.5));
  camera.near_m = static_cast<float>(random.magnitude(1e-3, 1.0));
  camera.t = ray.t;
  camera.mask = ray.mask;
  camera.carrier = ray.carrier;
  camera.seed = static_cast<std::uint32_t>(random.below(1u << 30));
  if (!rolls) return camera;
  camera.row_time = Nanoseconds(static_cast<std::int64_t>(random.uniform(0.0, 0.02) * window_s * 1e9));
  camera.exposure = Nanoseconds(static_cast<std::int64_t>(random.uniform(0.0, 0.2) * window_s * 1e9));
  return camera;
}

void fill_with_neighbours(std::span<Ray> rays, Random& random, std::span<const EntityState> entities,
                          const SceneOptions& options, WorldTime first, double window_s) {
  std::vector<Ray> group;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (i % 8 == 0) group = random_neighbours(random, entities, options, first, window_s);
    rays[i] = group[i % 8];
  }
}

Region random_region(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s) {
  Region region;
  region.shape = random.one_in(2) ? RegionShape::sphere : RegionShape::box;
  region.test = random.one_in(3) ? RegionTest::inside : RegionTest::touching;
  region.t = random_time(random, first, window_s);
  const EntityState& target = random_entity(random, entities);
  const double size_m = options.radius_m * random.magnitude(0.01, 1.0);
  region.center_m = pose_at(target.row.motion, region.t).p_world_m + (0.3 + 0.7 * size_m) * random.vector();
  region.half_extent_m = size_m * glm::dvec3(random.magnitude(0.3, 3.0), random.magnitude(0.3, 3.0), 1.0);
  // Queries normalize q.
  if (random.one_in(2)) region.q = random.magnitude(0.1, 10.0) * random.orientation();
  if (random.one_in(4)) region.mask = static_cast<std::uint32_t>(random.below(16));
  if (random.one_in(4)) {
    region.carrier = target.id;
    region.center_m = 3.0 * random.vector();
  }
  if (random.one_in(3)) {
    region.shape = RegionShape::frustum;
    region.half_extent_m.x = static_cast<float>(3.0 * size_m * random.magnitude(0.3, 3.0));
    if (random.one_in(2))
      region.near_m = region.half_extent_m.x * static_cast<float>(random.uniform(0.0, 1.0));
    if (random.one_in(2)) region.q = random.orientation();
    // In most cases the target lies in the view.
    if (!region.carrier.valid())
      region.center_m -= glm::normalize(region.q) * glm::vec3(0.5f * region.half_extent_m.x, 0.0f, 0.0f);
  }
  return region;
}

Nearest random_point(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s) {
  Nearest point;
  point.t = random_time(random, first, window_s);
  const EntityState& target = random_entity(random, entities);
  point.point_m =
      pose_at(target.row.motion, point.t).p_world_m + random.magnitude(0.05, 5.0) * random.vector();
  if (random.one_in(4)) point.point_m = 2.0 * options.radius_m * random.vector();
  if (random.one_in(2)) point.radius_m = static_cast<float>(options.radius_m * random.magnitude(0.01, 3.0));
  if (random.one_in(4)) point.mask = static_cast<std::uint32_t>(random.below(16));
  if (random.one_in(4)) {
    point.carrier = target.id;
    point.point_m = 2.0 * random.vector();
  }
  if (random.one_in(4)) point.excluded = target.id;
  return point;
}

namespace {

EntityId random_body(Random& random, std::span<const EntityState> entities) {
  const EntityState* state = nullptr;
  while (state == nullptr || !state->row.geometry.valid())
    state = &random_entity(random, entities);
  return state->id;
}

EntityId random_other_body(Random& random, std::span<const EntityState> entities, EntityId first) {
  EntityId second = first;
  while (second == first)
    second = random_body(random, entities);
  return second;
}

}  // namespace

ContactSearch random_contact_search(Random& random, std::span<const EntityState> entities, WorldTime first,
                                    double window_s) {
  ContactSearch search;
  search.t = random_time(random, first, window_s);
  if (random.one_in(3)) search.margin_m = static_cast<float>(random.magnitude(0.001, 1.0));
  if (random.one_in(3)) search.second_mask = static_cast<std::uint32_t>(random.below(16));
  if (random.one_in(64)) {
    search.first_mask = static_cast<std::uint32_t>(random.below(4));
    return search;
  }
  search.first = random_body(random, entities);
  if (random.one_in(2)) search.second = random_other_body(random, entities, search.first);
  return search;
}

ImpactSearch random_impact_search(Random& random, std::span<const EntityState> entities, WorldTime first,
                                  double window_s) {
  ImpactSearch search;
  search.t = random_time(random, first, window_s);
  search.first = random_body(random, entities);
  if (random.one_in(2)) search.second = random_other_body(random, entities, search.first);
  if (random.one_in(3)) search.second_mask = static_cast<std::uint32_t>(random.below(16));
  search.window = Nanoseconds(static_cast<std::int64_t>(random.magnitude(1e6, 2e9)));
  search.tolerance_m = static_cast<float>(random.magnitude(0.001, 0.1));
  return search;
}

}  // namespace rtstdb::test
