// Traversal of the trees gives the answers of brute force.

#include <gtest/gtest.h>

#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

void expect_equal(const RayTruth& a, const RayTruth& b, int which) {
  ASSERT_EQ(a.status, b.status) << which;
  ASSERT_EQ(a.entity, b.entity) << which;
  ASSERT_EQ(a.triangle, b.triangle) << which;
  ASSERT_EQ(a.lambda, b.lambda) << which;
  ASSERT_EQ(a.u, b.u) << which;
  ASSERT_EQ(a.v, b.v) << which;
}

TEST(MeshTree, AgreesWithBruteForceInRandomScenes) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Scene scene = crowd(seed, 30);
    const World world = scene.world();
    Random random(seed + 100);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
      const Ray ray = random_ray(random, scene);
      const bool ignore_motion = i % 5 == 0;
      const RayTruth fast = trace(world, ray, RayMode::closest, ignore_motion);
      expect_equal(fast, trace_brute_force(world, ray, RayMode::closest, ignore_motion), i);
      ASSERT_EQ(trace(world, ray, RayMode::any, ignore_motion).status, fast.status) << i;
      hits += fast.status == HitStatus::hit;
    }
    EXPECT_GT(hits, 200);
    EXPECT_LT(hits, 1900);
  }
}

TEST(MeshTree, AgreesWithBruteForceAlongFacesAndEdges) {
  Scene scene;
  scene.place(make_cylinder(1.0, 2.0, 8));
  scene.place(make_box({2, 2, 2}), at({4, 0, 0}));
  scene.place(make_rectangle(3, 3), at({0, 4, 0}));
  const World world = scene.world();
  Random random(7);
  const auto grid = [&random] { return static_cast<float>(random.integer(-8, 8)) * 0.5f; };
  for (int i = 0; i < 5000; ++i) {
    glm::vec3 direction(random.integer(-1, 1), random.integer(-1, 1), random.integer(-1, 1));
    if (direction == glm::vec3(0.0f)) direction.x = 1.0f;
    const float x = grid();
    const float y = grid();
    const Ray ray = ray_from({x, y, grid()}, direction);
    expect_equal(trace(world, ray), trace_brute_force(world, ray), i);
  }
}

TEST(MeshTree, HandlesManyEqualTriangles) {
  TriangleMesh pile{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, std::vector<glm::uvec3>(1000, {0, 1, 2})};
  pile.triangles[0] = {0, 0, 0};
  Scene scene;
  scene.place(pile);
  const RayTruth hit = trace(scene.world(), ray_from({0.25f, 0.25f, 1.0f}, {0, 0, -1}));
  ASSERT_EQ(hit.status, HitStatus::hit);
  EXPECT_EQ(hit.triangle, 1u);
}

}  // namespace
}  // namespace rtstdb::oracle
