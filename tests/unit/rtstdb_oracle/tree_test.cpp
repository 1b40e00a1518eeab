// The trees change no answer.

#include <gtest/gtest.h>

#include <filesystem>

#include "scene.hpp"
#include "tests/support/real_data.hpp"

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

TEST(MeshTree, GivesTheAnswersOfBruteForceInACrowd) {
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

TEST(MeshTree, GivesThemForRaysAlongFacesAndEdgesToo) {
  Scene scene;
  scene.place(make_cylinder(1.0, 2.0, 8));
  scene.place(make_box({2, 2, 2}), at({4, 0, 0}));
  scene.place(make_rectangle(3, 3), at({0, 4, 0}));
  const World world = scene.world();
  Random random(7);
  const auto grid = [&random] { return static_cast<float>(random.below(17) - 8) * 0.5f; };
  for (int i = 0; i < 5000; ++i) {
    glm::vec3 direction(random.below(3) - 1, random.below(3) - 1, random.below(3) - 1);
    if (direction == glm::vec3(0.0f)) direction.x = 1.0f;
    const float x = grid();
    const float y = grid();
    const Ray ray = ray_from({x, y, grid()}, direction);
    expect_equal(trace(world, ray), trace_brute_force(world, ray), i);
  }
}

TEST(MeshTree, HandlesManyTrianglesInOnePlace) {
  TriangleMesh pile{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, std::vector<glm::uvec3>(1000, {0, 1, 2})};
  pile.triangles[0] = {0, 0, 0};
  Scene scene;
  scene.place(pile);
  const RayTruth hit = trace(scene.world(), ray_from({0.25f, 0.25f, 1.0f}, {0, 0, -1}));
  ASSERT_EQ(hit.status, HitStatus::hit);
  EXPECT_EQ(hit.triangle, 1u);
}

class RealMeshTree : public testing::TestWithParam<std::filesystem::path> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RealMeshTree);
INSTANTIATE_TEST_SUITE_P(Found, RealMeshTree, testing::ValuesIn(hil::test::real_mesh_folders()),
                         [](const auto&) { return "meshes"; });

TEST_P(RealMeshTree, GivesTheAnswersOfBruteForce) {
  const Result<TriangleMesh> bunny = load_mesh(GetParam() / "stanford-bunny.obj");
  ASSERT_TRUE(bunny.ok()) << bunny.error().message;
  const Bounds bounds = bounds_of(bunny.value());
  const glm::dvec3 center = 0.5 * (glm::dvec3(bounds.minimum_m) + glm::dvec3(bounds.maximum_m));
  const double size = glm::length(glm::dvec3(bounds.maximum_m - bounds.minimum_m));
  Scene scene;
  scene.place(bunny.value());
  const World world = scene.world();
  Random random(8);
  int hits = 0;
  for (int i = 0; i < 500; ++i) {
    const glm::dvec3 from = center + size * random.direction();
    const glm::dvec3 to = center + 0.3 * size * random.vector();
    const Ray ray = ray_from(glm::vec3(from), glm::vec3(to - from));
    const RayTruth fast = trace(world, ray);
    expect_equal(fast, trace_brute_force(world, ray), i);
    hits += fast.status == HitStatus::hit;
  }
  EXPECT_GT(hits, 100);
}

}  // namespace
}  // namespace rtstdb::oracle
