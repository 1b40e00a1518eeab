#pragma once
// Worlds, elements and comparisons for the tests of the oracle.

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <deque>
#include <numbers>
#include <utility>
#include <vector>

#include "rtstdb/oracle/oracle.hpp"
#include "tests/support/random.hpp"

namespace rtstdb::oracle {

inline constexpr double pi = std::numbers::pi;

inline WorldTime at_s(double seconds) {
  return world_time_ns(std::llround(seconds * 1e9));
}

struct Scene {
  std::deque<TriangleMesh> meshes;
  std::vector<EntityState> entities;
  WorldTime version_time{};

  GeometryId add(TriangleMesh mesh) {
    meshes.push_back(std::move(mesh));
    return {static_cast<std::uint32_t>(meshes.size() - 1)};
  }
  EntityRow& place(GeometryId geometry, const Motion& motion = {}) {
    EntityState state;
    state.id = {static_cast<std::uint32_t>(entities.size()), 1};
    state.row.geometry = geometry;
    state.row.motion = motion;
    entities.push_back(state);
    return entities.back().row;
  }
  EntityRow& place(TriangleMesh mesh, const Motion& motion = {}) {
    return place(add(std::move(mesh)), motion);
  }
  EntityId last() const { return entities.back().id; }
  World world() const {
    std::vector<const TriangleMesh*> pointers;
    for (const TriangleMesh& mesh : meshes)
      pointers.push_back(&mesh);
    return {entities, pointers, version_time};
  }
};

inline Motion at(const glm::dvec3& p_world_m) {
  Motion motion;
  motion.p_world_m = p_world_m;
  return motion;
}

inline Ray ray_from(const glm::vec3& origin_m, const glm::vec3& direction, WorldTime t = {}) {
  Ray ray;
  ray.origin_m = origin_m;
  ray.direction = direction;
  ray.t = t;
  return ray;
}

inline NearestQueryOptions nearest_options(NearestTarget target, std::uint32_t k = 1,
                                           bool is_signed = false) {
  return {.name = "test", .capacity = 1, .target = target, .k = k, .is_signed = is_signed};
}

inline void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-12) {
  EXPECT_LE(glm::length(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") against (" << b.x
                                           << ", " << b.y << ", " << b.z << ")";
}

using test::Random;

/// Moving, turning, scaled bodies within some tens of metres.
inline Scene crowd(std::uint64_t seed, int count) {
  Random random(seed);
  Scene scene;
  const GeometryId shapes[] = {scene.add(make_box({1.0, 2.0, 3.0})), scene.add(make_sphere(1.0, 2)),
                               scene.add(make_cylinder(0.5, 2.0, 12)), scene.add(make_rectangle(4.0, 3.0))};
  scene.version_time = at_s(10.0);
  for (int i = 0; i < count; ++i) {
    EntityRow& row = scene.place(shapes[random.below(4)]);
    row.scale = {random.magnitude(0.3, 4.0), random.magnitude(0.3, 4.0), random.magnitude(0.3, 4.0)};
    row.mask = 1u << random.below(3);
    row.motion.p_world_m = 8.0 * random.vector();
    row.motion.q_world = random.orientation();
    row.motion.valid_from = at_s(random.uniform(9.0, 10.0));
    if (random.below(3) != 0) {
      row.motion.v_world_mps = 10.0 * random.vector();
      row.motion.w_world_radps = random.magnitude(0.1, 20.0) * random.direction();
    }
  }
  return scene;
}

/// A ray towards a random body of the scene. Some rays have a carrier, a mask or a maximum lambda.
inline Ray random_ray(Random& random, const Scene& scene) {
  const auto random_entity = [&]() -> const EntityState& {
    return scene.entities[random.below(scene.entities.size())];
  };
  const WorldTime t = scene.version_time + Nanoseconds(random.integer(0, 999'999'999));
  const glm::dvec3 from_m = 15.0 * random.vector();
  const glm::dvec3 to_m = pose_at(random_entity().row.motion, t).p_world_m + 0.7 * random.vector();
  Ray ray = ray_from(glm::vec3(from_m), glm::vec3(random.magnitude(0.01, 10.0) * (to_m - from_m)), t);
  if (random.below(4) == 0) {
    const EntityState& carrier = random_entity();
    const Pose pose = pose_at(carrier.row.motion, t);
    const glm::dquat to_carrier = glm::conjugate(pose.q_world);
    ray.carrier = carrier.id;
    ray.origin_m = glm::vec3(3.0 * random.vector());
    ray.direction = glm::vec3(to_carrier * (to_m - pose.p_world_m) - glm::dvec3(ray.origin_m));
  }
  if (random.below(4) == 0) ray.mask = 3;
  if (random.below(4) == 0) ray.lambda_max = static_cast<float>(random.uniform(0.1, 2.0));
  return ray;
}

}  // namespace rtstdb::oracle
