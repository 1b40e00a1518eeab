// No ray passes between the triangles of a closed surface.

#include "rtstdb/oracle/watertight.hpp"

#include <gtest/gtest.h>

#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

/// From outside through a point of the surface.
void expect_hit(const World& world, const glm::dvec3& from, const glm::dvec3& through) {
  Ray ray = ray_from(glm::vec3(from), glm::vec3(through - from));
  ASSERT_EQ(trace(world, ray).status, HitStatus::hit)
      << "from " << from.x << " " << from.y << " " << from.z << " through " << through.x << " " << through.y
      << " " << through.z;
}

TEST(Watertight, RaysAtCornersAndEdgesOfClosedMeshesHit) {
  Random random(1);
  for (const TriangleMesh& mesh : {make_sphere(1.0, 2), make_box({1, 2, 3}), make_cylinder(1.0, 2.0, 17)}) {
    Scene scene;
    scene.place(mesh);
    const World world = scene.world();
    for (const glm::uvec3& t : mesh.triangles) {
      for (int i = 0; i < 3; ++i) {
        const glm::dvec3 a(mesh.positions_m[t[i]]);
        const glm::dvec3 b(mesh.positions_m[t[(i + 1) % 3]]);
        for (const double part : {0.0, 0.5, random.uniform(0.0, 1.0)}) {
          const glm::dvec3 target = a + part * (b - a);
          // Towards the inside, so that the ray hits for each rounding.
          const glm::dvec3 inner = 0.2 * random.uniform(0.0, 1.0) * target;
          const glm::dvec3 from = inner + (target - inner) * random.magnitude(2.0, 1000.0);
          expect_hit(world, from, target);
        }
      }
    }
  }
}

TEST(Watertight, AxisParallelRaysAlongTheEdgesOfAWallHit) {
  // Each ray hits an edge or a corner of the wall's grid.
  TriangleMesh wall;
  constexpr int n = 16;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x)
      wall.positions_m.emplace_back(x, y, 0.0f);
  }
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const auto a = static_cast<std::uint32_t>(y * (n + 1) + x);
      wall.triangles.push_back({a, a + 1, a + n + 2});
      wall.triangles.push_back({a, a + n + 2, a + n + 1});
    }
  }
  Scene scene;
  scene.place(wall);
  const World world = scene.world();
  for (int y = 0; y <= 2 * n; ++y) {
    for (int x = 0; x <= 2 * n; ++x) {
      for (const float z : {5.0f, -5.0f, 1e5f}) {
        const RayTruth hit = trace(world, ray_from(glm::vec3(0.5 * x, 0.5 * y, z), {0, 0, -z}));
        ASSERT_EQ(hit.status, HitStatus::hit) << x << " " << y;
        EXPECT_EQ(hit.lambda, 1.0);
      }
    }
  }
}

TEST(Watertight, AxisParallelRaysHitTheSidesOfABox) {
  Scene scene;
  scene.place(make_box({2, 4, 6}));
  const World world = scene.world();
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0f, -1.0f}) {
      // Through the middle, where the diagonals cross, and along corners and edges of the box itself.
      for (const glm::vec3& offset :
           {glm::vec3(0), glm::vec3(0.5f), glm::vec3(1, 2, 3), glm::vec3(-1, 0, 3)}) {
        glm::vec3 origin = offset;
        origin[axis] = -10.0f * sign;
        glm::vec3 direction(0.0f);
        direction[axis] = sign;
        const RayTruth hit = trace(world, ray_from(origin, direction));
        ASSERT_EQ(hit.status, HitStatus::hit) << axis << " " << sign;
        EXPECT_EQ(hit.lambda, 10.0 - (axis + 1));
      }
    }
  }
}

TEST(Watertight, VeryLongRaysHit) {
  Scene scene;
  scene.place(make_sphere(1.0, 3), at({9e4, -9e4, 9e4}));
  const World world = scene.world();
  Ray ray = ray_from({-9e4f, 9e4f, -9e4f}, {1.0f, -1.0f, 1.0f});
  RayTruth hit = trace(world, ray);
  ASSERT_EQ(hit.status, HitStatus::hit);
  EXPECT_NEAR(hit.lambda, 1.8e5 - 1.0 / std::sqrt(3.0), 0.01);
  ray.direction *= 1e-20f;
  hit = trace(world, ray);
  ASSERT_EQ(hit.status, HitStatus::hit);
  EXPECT_NEAR(hit.lambda / 1e20, 1.8e5, 1.0);
  ray.direction *= 1e35f;
  EXPECT_EQ(trace(world, ray).status, HitStatus::hit);
}

TEST(WatertightTest, HitsOneOfTwoTrianglesAtTheirEdge) {
  // Rays towards the common edge of two triangles: at least one triangle is hit for each rounding.
  Random random(3);
  int both = 0;
  for (int i = 0; i < 200'000; ++i) {
    const glm::dvec3 a = random.vector();
    const glm::dvec3 b = random.vector();
    const LocalRay ray{5.0 * random.direction(), {}, 0.0, 1e9};
    LocalRay aimed = ray;
    aimed.direction = a + random.uniform(0.01, 0.99) * (b - a) - ray.origin;
    // The far corners lie to either side of the plane of ray and edge.
    const glm::dvec3 side = glm::cross(aimed.direction, b - a);
    const glm::dvec3 c = 0.5 * (a + b) + side * random.uniform(0.1, 1.0) + 0.1 * aimed.direction;
    const glm::dvec3 d = 0.5 * (a + b) - side * random.uniform(0.1, 1.0) - 0.1 * aimed.direction;
    const WatertightTest meets(aimed);
    const bool left = meets({a, b, c}, 0.0, 1e9).has_value();
    const bool right = meets({b, a, d}, 0.0, 1e9).has_value();
    ASSERT_TRUE(left || right);
    both += left && right;
  }
  EXPECT_LT(both, 200'000 / 2);
}

}  // namespace
}  // namespace rtstdb::oracle
