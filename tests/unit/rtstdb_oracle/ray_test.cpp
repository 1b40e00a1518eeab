#include <gtest/gtest.h>

#include <limits>

#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

TriangleMesh one_triangle() {
  return {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{0, 1, 2}}};
}

TEST(Trace, ReportsAllValuesOfAHit) {
  Scene scene;
  scene.place(one_triangle());
  const RayTruth hit = trace(scene.world(), ray_from({1, 2, 8}, {0, 0, -2}));
  ASSERT_EQ(hit.status, HitStatus::hit);
  EXPECT_EQ(hit.lambda, 4.0);
  EXPECT_EQ(hit.u, 0.25);
  EXPECT_EQ(hit.v, 0.5);
  EXPECT_EQ(hit.entity, scene.last());
  EXPECT_EQ(hit.triangle, 0u);
  EXPECT_TRUE(hit.front_face);
  expect_near(hit.n_world, {0, 0, 1});
  expect_near(hit.v_relative_mps, {0, 0, 0});
  EXPECT_EQ(hit.incidence_cosine, 1.0);
  EXPECT_NEAR(hit.edge_distance_m, 1.0 / std::sqrt(2.0), 1e-12);
  EXPECT_GT(hit.noise_m, 0.0);
}

TEST(Trace, MissesBesideBehindAndEdgeOn) {
  Scene scene;
  scene.place(one_triangle());
  const World world = scene.world();
  EXPECT_EQ(trace(world, ray_from({3, 3, 8}, {0, 0, -1})).status, HitStatus::miss);
  EXPECT_EQ(trace(world, ray_from({1, 1, 8}, {0, 0, 1})).status, HitStatus::miss);
  EXPECT_EQ(trace(world, ray_from({-1, 1, 0}, {1, 0, 0})).status, HitStatus::miss);
  EXPECT_FALSE(trace(world, ray_from({3, 3, 8}, {0, 0, -1})).entity.valid());
  EXPECT_EQ(trace(Scene().world(), ray_from({3, 3, 8}, {0, 0, -1})).status, HitStatus::miss);
}

TEST(Trace, IncludesBothEndsOfTheRange) {
  Scene scene;
  scene.place(one_triangle());
  const World world = scene.world();
  Ray ray = ray_from({1, 1, 8}, {0, 0, -1});
  ray.lambda_min = ray.lambda_max = 8.0f;
  EXPECT_EQ(trace(world, ray).status, HitStatus::hit);
  ray.lambda_max = 20.0f;
  ray.lambda_min = std::nextafter(8.0f, 9.0f);
  EXPECT_EQ(trace(world, ray).status, HitStatus::miss);
  ray.lambda_min = 0.0f;
  ray.lambda_max = std::nextafter(8.0f, 7.0f);
  EXPECT_EQ(trace(world, ray).status, HitStatus::miss);
  ray = ray_from({1, 1, -8}, {0, 0, -1});
  ray.lambda_min = -10.0f;  // a negative range is allowed
  EXPECT_EQ(trace(world, ray).lambda, -8.0);
}

TEST(Trace, ReturnsTheClosestHit) {
  Scene scene;
  for (const double z : {5.0, 9.0, -3.0})
    scene.place(one_triangle(), at({0.0, 0.0, z}));
  Ray ray = ray_from({1, 1, 20}, {0, 0, -1});
  EXPECT_EQ(trace(scene.world(), ray).entity.index, 1u);
  ray.lambda_min = 12.0f;
  EXPECT_EQ(trace(scene.world(), ray).entity.index, 0u);
}

TEST(Trace, BreaksTiesByEntityThenTriangle) {
  Scene scene;
  const TriangleMesh twice{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{0, 1, 2}, {1, 2, 0}, {2, 1, 0}}};
  scene.place(one_triangle(), at({0, 0, -1}));
  scene.place(twice);
  scene.place(twice);
  for (const glm::vec3& from :
       {glm::vec3(1, 1, 8), glm::vec3(0.3f, 0.7f, 3.3f), glm::vec3(1.7f, 0.1f, 1e3f)}) {
    const RayTruth hit = trace(scene.world(), ray_from(from, {0, 0, -1}));
    EXPECT_EQ(hit.entity.index, 1u);
    EXPECT_EQ(hit.triangle, 0u);
  }
  // The shared edge of two triangles; double precision holds these oblique rays exactly.
  Scene square;
  square.place(make_rectangle(2.0, 2.0));
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const auto along = static_cast<float>(random.integer(-128, 127)) / 128.0f;
    const glm::vec3 on_edge(along, along, 0.0f);
    const glm::vec3 direction(random.integer(-4, 4), random.integer(-4, 4), i % 2 == 0 ? -4 : -8);
    const RayTruth hit = trace(square.world(), ray_from(on_edge - 4.0f * direction, direction));
    ASSERT_EQ(hit.status, HitStatus::hit);
    EXPECT_EQ(hit.triangle, 0u);
    EXPECT_EQ(hit.edge_distance_m, 0.0);
  }
}

TEST(Trace, BreaksTiesThatRoundDifferently) {
  // One wall under two entities with different motions but the same pose at all times.
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    Motion motion = at(100.0 * random.vector());
    motion.q_world = random.orientation();
    motion.v_world_mps = random.vector();
    motion.w_world_radps = random.vector();
    Scene scene;
    scene.place(make_rectangle(4, 4), rebased(motion, at_s(0.3)));
    scene.place(make_rectangle(4, 4), motion);
    const WorldTime t = at_s(random.uniform(0.0, 1.0));
    const glm::vec3 to(pose_at(motion, t).p_world_m);
    const glm::vec3 from = to + glm::vec3(10.0 * random.direction());
    const RayTruth hit = trace(scene.world(), ray_from(from, to - from, t));
    ASSERT_EQ(hit.status, HitStatus::hit);
    EXPECT_EQ(hit.entity.index, 0u);
  }
}

TEST(Trace, IgnoresMaskedEntities) {
  Scene scene;
  scene.place(one_triangle(), at({0, 0, 2})).mask = 0b01;
  scene.place(one_triangle()).mask = 0b10;
  scene.place(one_triangle(), at({0, 0, 4})).mask = 0;
  Ray ray = ray_from({1, 1, 8}, {0, 0, -1});
  EXPECT_EQ(trace(scene.world(), ray).entity.index, 0u);
  ray.mask = 0b10;
  EXPECT_EQ(trace(scene.world(), ray).entity.index, 1u);
  ray.mask = 0b100;
  EXPECT_EQ(trace(scene.world(), ray).status, HitStatus::miss);
}

TEST(Trace, AnyFillsOnlyTheStatus) {
  Scene scene;
  scene.place(one_triangle());
  const RayTruth hit = trace(scene.world(), ray_from({1, 1, 8}, {0, 0, -1}), RayMode::any);
  EXPECT_EQ(hit.status, HitStatus::hit);
  EXPECT_FALSE(hit.entity.valid());
  EXPECT_EQ(hit.lambda, 0.0);
  EXPECT_EQ(trace(scene.world(), ray_from({9, 9, 8}, {0, 0, -1}), RayMode::any).status, HitStatus::miss);
}

TEST(Trace, NeverHitsTrianglesWithoutArea) {
  Scene scene;
  scene.place(
      {{{-1, 0, 0}, {1, 0, 0}, {3, 0, 0}, {0, 1, 5}, {0.1f, 0.3f, 0.7f}, {0.2f, 0.6f, 1.4f}, {0, 0, 0}},
       {{0, 1, 2}, {0, 0, 1}, {6, 4, 5}, {3, 4, 5}}});
  const World world = scene.world();
  EXPECT_EQ(trace(world, ray_from({0, 0, 2}, {0, 0, -1})).status, HitStatus::miss);
  EXPECT_EQ(trace(world, ray_from({0, 0, 2}, {0.5f, 0, -1})).status, HitStatus::miss);
  EXPECT_EQ(trace(world, ray_from({0.05f, -1.0f, 0.35f}, {0, 1.15f, 0})).status, HitStatus::miss);
}

TEST(Trace, ScalesNormalsInversely) {
  Scene scene;
  EntityRow& row = scene.place({{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2}}});
  row.scale = {1.0, 2.0, 4.0};
  row.motion.q_world = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, 3)));
  const glm::dquat q = row.motion.q_world;
  const glm::dvec3 inside = q * (glm::dvec3(1, 2, 4) / 3.0);
  const RayTruth hit = trace(scene.world(), ray_from(glm::vec3(inside * 5.0), glm::vec3(-inside)));
  ASSERT_EQ(hit.status, HitStatus::hit);
  expect_near(hit.n_world, q * glm::normalize(glm::dvec3(1.0, 0.5, 0.25)), 1e-12);
  EXPECT_TRUE(hit.front_face);
  EXPECT_NEAR(hit.u, 1.0 / 3.0, 1e-6);
  EXPECT_NEAR(hit.v, 1.0 / 3.0, 1e-6);
}

TEST(Trace, ReportsConsistentValues) {
  // lambda, and u and v with the corners, give one point; the normal is perpendicular to the triangle.
  const Scene scene = crowd(5, 40);
  const World world = scene.world();
  Random random(6);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Ray ray = random_ray(random, scene);
    if (ray.carrier.valid()) continue;
    const RayTruth hit = trace(world, ray);
    if (hit.status != HitStatus::hit) continue;
    ++hits;
    const EntityState& state = *world.find(hit.entity);
    const Pose pose = pose_at(state.row.motion, ray.t);
    auto c = world.mesh_of(state).corners(hit.triangle);
    for (glm::dvec3& corner : c)
      corner = pose.p_world_m + pose.q_world * (state.row.scale * corner);
    const glm::dvec3 named = c[0] + hit.u * (c[1] - c[0]) + hit.v * (c[2] - c[0]);
    expect_near(named, glm::dvec3(ray.origin_m) + hit.lambda * glm::dvec3(ray.direction), 1e-10);
    expect_near(hit.n_world, glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0])), 1e-10);
    EXPECT_EQ(hit.front_face, glm::dot(hit.n_world, glm::dvec3(ray.direction)) < 0.0);
  }
  EXPECT_GT(hits, 300);
}

TEST(TraceDeathTest, InvalidRaysAreMisuse) {
  Scene scene;
  scene.place(one_triangle());
  const World world = scene.world();
  EXPECT_DEATH(trace(world, ray_from({0, 0, 0}, {0, 0, 0})),
               "the ray is not finite, or its direction is zero");
  EXPECT_DEATH(trace(world, ray_from({0, 0, 0}, {0, 0, std::numeric_limits<float>::quiet_NaN()})),
               "the ray is not finite, or its direction is zero");
  Ray carried = ray_from({0, 0, 0}, {1, 0, 0});
  carried.carrier = {0, 2};  // an old generation
  EXPECT_DEATH(trace(world, carried), "the carrier does not exist");
}

}  // namespace
}  // namespace rtstdb::oracle
