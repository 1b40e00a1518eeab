// Moving entities and carriers compared with closed forms; each ray has its own time.

#include <gtest/gtest.h>

#include "scene.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::oracle {
namespace {

TEST(RayMotion, HitsAPlaneAtItsPoseAtTheTimeOfTheRay) {
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    Motion motion = at(random.vector());
    motion.q_world = random.orientation();
    motion.v_world_mps = 20.0 * random.vector();
    motion.valid_from = at_s(3.0);
    Scene scene;
    scene.place(make_rectangle(2000, 2000), motion);
    const double t_s = 3.0 + random.uniform(-0.5, 1.0);
    const Ray ray = ray_from(glm::vec3(10.0 * random.vector()), glm::vec3(random.vector()), at_s(t_s));
    const glm::dvec3 n = motion.q_world * glm::dvec3(0, 0, 1);
    const glm::dvec3 p = motion.p_world_m + seconds_between(motion.valid_from, ray.t) * motion.v_world_mps;
    const double expected =
        glm::dot(n, p - glm::dvec3(ray.origin_m)) / glm::dot(n, glm::dvec3(ray.direction));
    const RayTruth hit = trace(scene.world(), ray);
    if (expected < 0.0 || expected * glm::length(glm::dvec3(ray.direction)) > 500.0) continue;
    ASSERT_EQ(hit.status, HitStatus::hit);
    EXPECT_NEAR(hit.lambda, expected, 1e-9 * (1.0 + expected));
    expect_near(hit.v_relative_mps, motion.v_world_mps, 1e-12);
    expect_near(hit.n_world, n, 1e-12);
  }
}

/// The nearer root of |o + lambda d - c| = r, or NaN.
double sphere_lambda(const glm::dvec3& o, const glm::dvec3& d, const glm::dvec3& c, double r) {
  const double a = glm::dot(d, d);
  const double half_b = glm::dot(d, o - c);
  const double discriminant = half_b * half_b - a * (glm::dot(o - c, o - c) - r * r);
  return (-half_b - std::sqrt(discriminant)) / a;
}

TEST(RayMotion, HitsASphereMeshBetweenItsInnerAndOuterRadius) {
  // The mesh, and so the hit, lies between the ball through its corners and the ball inside its faces.
  const double outer_m = 2.0;
  const TriangleMesh mesh = make_sphere(outer_m, 4);
  double inner_m = outer_m;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions_m[t.x]);
    const glm::dvec3 n = glm::normalize(
        glm::cross(glm::dvec3(mesh.positions_m[t.y]) - a, glm::dvec3(mesh.positions_m[t.z]) - a));
    inner_m = std::min(inner_m, glm::dot(n, a));
  }
  EXPECT_GT(inner_m, 0.995 * outer_m);
  Random random(2);
  std::uint64_t hits = 0;
  const std::uint64_t worlds = hil::tests::rounds(500);
  for (std::uint64_t i = 0; i < worlds; ++i) {
    Motion motion = at(5.0 * random.vector());
    motion.v_world_mps = 20.0 * random.vector();
    motion.w_world_radps = 10.0 * random.vector();
    Scene scene;
    scene.place(mesh, motion);
    const WorldTime t = at_s(random.uniform(0.0, 1.0));
    const glm::dvec3 center = motion.p_world_m + seconds_between({}, t) * motion.v_world_mps;
    const glm::vec3 origin(center + 10.0 * random.direction());
    const glm::vec3 aim(center + random.uniform(0.0, 2.5) * random.direction());
    const Ray ray = ray_from(origin, aim - origin, t);
    const double at_outer =
        sphere_lambda(glm::dvec3(origin), glm::dvec3(ray.direction), center, outer_m * (1 + 1e-6));
    const double at_inner = sphere_lambda(glm::dvec3(origin), glm::dvec3(ray.direction), center, inner_m);
    const RayTruth hit = trace(scene.world(), ray);
    if (std::isnan(at_outer)) {
      EXPECT_EQ(hit.status, HitStatus::miss);
    } else if (!std::isnan(at_inner)) {
      ASSERT_EQ(hit.status, HitStatus::hit);
      EXPECT_GE(hit.lambda, at_outer);
      EXPECT_LE(hit.lambda, at_inner);
      ++hits;
    }
  }
  EXPECT_GT(hits, worlds / 2);
}

TEST(RayMotion, HitsATurningWallAtItsAngle) {
  // A wall through the origin that turns about z; a beam along y at x = 3 meets it at 3 tan(angle).
  Scene scene;
  Motion motion;
  motion.q_world = glm::angleAxis(pi / 2, glm::dvec3(1, 0, 0));  // upright, along x
  motion.w_world_radps = {0, 0, 2.0};
  scene.place(make_rectangle(200, 200), motion);
  const World world = scene.world();
  for (int i = 0; i < 102; ++i) {
    const double t_s = -0.7 + 0.0137 * i;
    const RayTruth hit = trace(world, ray_from({3, -100, 0.3f}, {0, 1, 0}, at_s(t_s)));
    ASSERT_EQ(hit.status, HitStatus::hit) << t_s;
    const double y = 3.0 * std::tan(2.0 * seconds_between({}, at_s(t_s)));
    EXPECT_NEAR(hit.lambda, 100.0 + y, 1e-9);
    expect_near(hit.v_relative_mps, {-2.0 * y, 6.0, 0.0}, 1e-8);  // w x r
  }
}

TEST(RayCarrier, MovesAndTurnsTheRay) {
  // A beacon at height 2 that turns about z on a car driving along x; a wall at x = 50.
  Scene scene;
  Motion car = at({1, 2, 0});
  car.v_world_mps = {10, 0, 0};
  car.w_world_radps = {0, 0, 1.5};
  scene.place(make_box({1, 1, 1}), car).mask = 1;
  const EntityId carrier = scene.last();
  Motion wall = at({50, 0, 0});
  wall.q_world = glm::angleAxis(-pi / 2, glm::dvec3(0, 1, 0));
  wall.v_world_mps = {-3, 0, 0};
  scene.place(make_rectangle(400, 400), wall).mask = 2;
  scene.entities[0].row.scale = {3, 3, 3};  // of the car; it does not scale the rays
  const World world = scene.world();
  for (int i = 0; i < 29; ++i) {
    const double t_s = 0.031 * i;
    Ray ray = ray_from({0.5f, 0, 2}, {2, 0, 0}, at_s(t_s));
    ray.carrier = carrier;
    ray.mask = 2;
    const RayTruth hit = trace(world, ray);
    ASSERT_EQ(hit.status, HitStatus::hit) << t_s;
    const double dt = seconds_between({}, ray.t);
    const double angle = 1.5 * dt;
    const glm::dvec3 forward(std::cos(angle), std::sin(angle), 0);
    const glm::dvec3 origin = glm::dvec3(1 + 10 * dt, 2, 2) + 0.5 * forward;
    EXPECT_NEAR(hit.lambda, (50 - 3 * dt - origin.x) / (2 * forward.x), 1e-9);
    const glm::dvec3 v_origin = glm::dvec3(10, 0, 0) + 0.5 * 1.5 * glm::dvec3(-forward.y, forward.x, 0);
    expect_near(hit.v_relative_mps, glm::dvec3(-3, 0, 0) - v_origin, 1e-12);
  }
}

TEST(RayCarrier, StandsStillForItsRay) {
  Scene scene;
  Motion motion = at({5, 6, 7});
  motion.q_world = glm::angleAxis(1.0, glm::normalize(glm::dvec3(1, 1, 0)));
  motion.v_world_mps = {100, -50, 3};
  motion.w_world_radps = {3, -2, 9};
  scene.place(make_box({2, 2, 2}), motion);
  const World world = scene.world();
  for (int i = 0; i < 20; ++i) {
    const double t_s = 0.1 * i;
    Ray ray = ray_from({0.25f, 0.5f, 4}, {0, 0, -1}, at_s(t_s));
    ray.carrier = scene.last();
    const RayTruth hit = trace(world, ray);
    ASSERT_EQ(hit.status, HitStatus::hit);
    EXPECT_NEAR(hit.lambda, 3.0, 1e-11);
    // Both turn together. What is left is w x (hit - origin), since the carrier's frame is not inertial.
    const glm::dvec3 between = pose_at(motion, ray.t).q_world * glm::dvec3(0, 0, -3);
    expect_near(hit.v_relative_mps, glm::cross(motion.w_world_radps, between), 1e-9);
  }
}

TEST(RayMotion, EqualsAStillWorldRebasedToTheTimeOfTheRay) {
  const Scene scene = crowd(11, 40);
  const World world = scene.world();
  Random random(12);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Ray ray = random_ray(random, scene);
    std::vector<EntityState> rebased_entities = scene.entities;
    for (EntityState& state : rebased_entities)
      state.row.motion = rebased(state.row.motion, ray.t);
    const World then = world.with_entities(rebased_entities, ray.t);
    const RayTruth moving = trace(world, ray);
    const RayTruth still = trace(then, ray, RayMode::closest, true);
    ASSERT_EQ(moving.status, still.status) << i;
    if (moving.status == HitStatus::miss) continue;
    ++hits;
    ASSERT_EQ(moving.entity, still.entity) << i;
    ASSERT_EQ(moving.triangle, still.triangle) << i;
    ASSERT_NEAR(moving.lambda, still.lambda, 1e-9 * (1.0 + moving.lambda)) << i;
    expect_near(moving.v_relative_mps, still.v_relative_mps,
                1e-9 * (1.0 + glm::length(moving.v_relative_mps)));
  }
  EXPECT_GT(hits, 300);
}

TEST(IgnoredMotion, TracesAtTheTimeOfTheVersionAndKeepsVelocities) {
  const Scene scene = crowd(13, 40);
  const World world = scene.world();
  Random random(14);
  int hits = 0;
  int moved = 0;
  for (int i = 0; i < 1000; ++i) {
    Ray ray = random_ray(random, scene);
    const RayTruth ignored = trace(world, ray, RayMode::closest, true);
    const RayTruth aware = trace(world, ray);
    ray.t = scene.version_time;
    const RayTruth early = trace(world, ray);
    ASSERT_EQ(ignored.status, early.status);
    ASSERT_EQ(ignored.entity, early.entity);
    ASSERT_EQ(ignored.lambda, early.lambda);
    ASSERT_EQ(ignored.v_relative_mps, early.v_relative_mps);
    moved += ignored.lambda != aware.lambda;
    hits += ignored.status == HitStatus::hit && glm::length(ignored.v_relative_mps) > 0.0;
  }
  EXPECT_GT(hits, 100);
  EXPECT_GT(moved, 100);
}

}  // namespace
}  // namespace rtstdb::oracle
