#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "rtstdb/oracle/nearest_point.hpp"
#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

Nearest at_point(const glm::vec3& point_m, WorldTime t = {}) {
  Nearest nearest;
  nearest.point_m = point_m;
  nearest.t = t;
  return nearest;
}

NeighborTruth only(const Scene& scene, const Nearest& point, NearestTarget target, bool is_signed = false) {
  const auto truth = nearest(scene.world(), point, nearest_options(target, 1, is_signed));
  EXPECT_EQ(truth.size(), 1u);
  return truth.empty() ? NeighborTruth{} : truth[0];
}

using Corners = std::array<glm::dvec3, 3>;

TEST(NearestOnTriangle, IsOnItsFaceEdgesOrCorners) {
  const Corners c{glm::dvec3{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const auto expect = [&](const glm::dvec3& p, const glm::dvec3& wanted, double u, double v) {
    const TrianglePoint nearest = nearest_on_triangle(c, p);
    expect_near(nearest.point, wanted);
    EXPECT_NEAR(nearest.u, u, 1e-12);
    EXPECT_NEAR(nearest.v, v, 1e-12);
  };
  expect({1, 1, 3}, {1, 1, 0}, 0.25, 0.25);
  expect({1, 2, -3}, {1, 2, 0}, 0.25, 0.5);
  expect({2, -1, 1}, {2, 0, 0}, 0.5, 0.0);
  expect({-5, 3, 1}, {0, 3, 0}, 0.0, 0.75);
  expect({3, 3, 1}, {2, 2, 0}, 0.5, 0.5);
  expect({-1, -1, 0}, {0, 0, 0}, 0.0, 0.0);
  expect({9, -1, 2}, {4, 0, 0}, 1.0, 0.0);
  expect({-1, 6, 2}, {0, 4, 0}, 0.0, 1.0);
  expect({1, 1, 0}, {1, 1, 0}, 0.25, 0.25);
}

TEST(NearestOnTriangle, WithoutAreaIsOnALineOrAPoint) {
  const Corners line{glm::dvec3{0, 0, 0}, {4, 0, 0}, {1, 0, 0}};
  expect_near(nearest_on_triangle(line, {3, 2, 0}).point, {3, 0, 0});
  expect_near(nearest_on_triangle(line, {7, 2, 1}).point, {4, 0, 0});
  const Corners point{glm::dvec3{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  expect_near(nearest_on_triangle(point, {5, 5, 5}).point, {1, 2, 3});
}

/// For the nearest point of a convex set, no part of the set is in the half space towards the given point.
TEST(NearestOnTriangle, IsNotFartherThanAnyOtherPoint) {
  Random random(70);
  for (int i = 0; i < 20'000; ++i) {
    Corners c{random.vector(), random.vector(), random.vector()};
    if (i % 3 == 1) c[2] = c[0] + random.uniform(-1.0, 2.0) * (c[1] - c[0]) + 1e-7 * random.vector();
    if (i % 3 == 2) c[2] = c[1] + 1e-5 * random.vector();
    const glm::dvec3 p = random.magnitude(0.01, 100.0) * random.vector();
    const TrianglePoint nearest = nearest_on_triangle(c, p);
    ASSERT_TRUE(nearest.u >= 0.0 && nearest.v >= 0.0 && nearest.u + nearest.v <= 1.0 + 1e-15);
    for (const glm::dvec3& corner : c)
      ASSERT_LT(glm::dot(p - nearest.point, corner - nearest.point), 1e-9 * glm::length(p - nearest.point))
          << "triangle " << i;
  }
}

/// Turned by a right angle about z and scaled: extends 4 in x, 1 in y and 3 in z from (10, 0, 0).
Scene turned_box() {
  Scene scene;
  Motion motion = at({10, 0, 0});
  motion.q_world = glm::angleAxis(glm::half_pi<double>(), glm::dvec3(0, 0, 1));
  scene.place(make_box({2, 2, 2}), motion).scale = {1.0, 4.0, 3.0};
  return scene;
}

TEST(NearestEntity, BoundsAreASolidBox) {
  const Scene scene = turned_box();
  const auto expect = [&](const glm::vec3& p, double distance_m, const glm::dvec3& wanted) {
    const NeighborTruth truth = only(scene, at_point(p), NearestTarget::bounds);
    EXPECT_NEAR(truth.distance_m, distance_m, 1e-12);
    expect_near(truth.p_world_m, wanted);
  };
  expect({0, 0, 0}, 6.0, {6, 0, 0});
  expect({10, 5, 0}, 4.0, {10, 1, 0});
  expect({17, 5, 0}, 5.0, {14, 1, 0});
  expect({2, -3, 5}, std::sqrt(16.0 + 4.0 + 4.0), {6, -1, 3});
  expect({11, 0.5f, -2}, 0.0, {11, 0.5, -2});
}

TEST(NearestEntity, CenterIsTheCenterOfTheBounds) {
  Scene scene;
  TriangleMesh off_center = make_box({2, 2, 2});
  for (glm::vec3& p : off_center.positions_m)
    p += glm::vec3(5, 0, 0);
  scene.place(off_center, at({0, 1, 0})).scale = {2, 1, 1};
  const NeighborTruth truth = only(scene, at_point({10, 0, 0}), NearestTarget::center);
  EXPECT_NEAR(truth.distance_m, 1.0, 1e-12);
  expect_near(truth.p_world_m, {10, 1, 0});
}

TEST(NearestSurface, OfABoxFromOutsideAndInside) {
  const Scene scene = turned_box();
  EXPECT_NEAR(only(scene, at_point({0, 0, 0}), NearestTarget::surface).distance_m, 6.0, 1e-12);
  EXPECT_NEAR(only(scene, at_point({17, 5, 0}), NearestTarget::surface).distance_m, 5.0, 1e-12);
  const NeighborTruth inside = only(scene, at_point({11, 0.25f, -2}), NearestTarget::surface, true);
  EXPECT_NEAR(inside.distance_m, -0.75, 1e-12);
  expect_near(inside.p_world_m, {11, 1, -2});
  EXPECT_TRUE(inside.has_sign);
  EXPECT_NEAR(only(scene, at_point({11, 0.25f, -2}), NearestTarget::surface).distance_m, 0.75, 1e-12);
}

TEST(NearestSurface, OfASphereMesh) {
  Scene scene;
  scene.place(make_sphere(2.0, 5), at({1, 2, 3}));
  const World world = scene.world();
  Random random(71);
  for (int i = 0; i < 500; ++i) {
    const double radius_m = random.magnitude(0.2, 50.0);
    const glm::vec3 p(glm::dvec3(1, 2, 3) + radius_m * random.direction());
    const auto truth = nearest(world, at_point(p), nearest_options(NearestTarget::surface, 1, true));
    ASSERT_EQ(truth.size(), 1u);
    // The faces lie below the sphere by the sagitta of their corners: less than 2 mm.
    const double sphere_m = glm::length(glm::dvec3(p) - glm::dvec3(1, 2, 3)) - 2.0;
    EXPECT_GT(truth[0].distance_m, sphere_m - 1e-12);
    EXPECT_LT(truth[0].distance_m, sphere_m + 0.002);
  }
}

TEST(NearestSign, OfANonconvexSurface) {
  // A box with a notch from above, from -0.5 to 0.5 and down to z = 0.
  Scene scene;
  TriangleMesh mesh;
  const float outline[8][2] = {{-2, -1},  {2, -1},    {2, 1},     {0.5f, 1},
                               {0.5f, 0}, {-0.5f, 0}, {-0.5f, 1}, {-2, 1}};
  for (const float y : {-1.0f, 1.0f}) {
    for (const auto& p : outline)
      mesh.positions_m.emplace_back(p[0], y, p[1]);
  }
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.emplace_back(a, b, c);
    mesh.triangles.emplace_back(a, c, d);
  };
  // Front (y = -1) and back as fans over the same pieces: left leg, middle, right leg.
  const glm::uvec3 caps[] = {{0, 5, 7}, {5, 6, 7}, {0, 1, 5}, {1, 4, 5}, {1, 2, 4}, {2, 3, 4}};
  for (const glm::uvec3& cap : caps) {
    mesh.triangles.push_back(cap);
    mesh.triangles.emplace_back(cap.x + 8, cap.z + 8, cap.y + 8);
  }
  for (std::uint32_t i = 0; i < 8; ++i)
    quad((i + 1) % 8, i, i + 8, (i + 1) % 8 + 8);
  scene.place(mesh);
  const auto distance_m = [&](const glm::vec3& p) {
    const NeighborTruth truth = only(scene, at_point(p), NearestTarget::surface, true);
    EXPECT_TRUE(truth.has_sign);
    return truth.distance_m;
  };
  EXPECT_NEAR(distance_m({0, 0, 0.8f}), 0.5, 1e-7) << "in the notch: outside, though inside the bounds";
  EXPECT_NEAR(distance_m({0, 0, 0.25f}), 0.25, 1e-7);
  EXPECT_NEAR(distance_m({0, 0, -0.25f}), -0.25, 1e-7) << "below it";
  EXPECT_NEAR(distance_m({1.25f, 0, 0.5f}), -0.5, 1e-7) << "in a leg";
  EXPECT_NEAR(distance_m({0.75f, 0, -0.25f}), -std::hypot(0.25, 0.25), 1e-7) << "nearest to the inner edge";
  EXPECT_NEAR(distance_m({0, 0, 3}), std::hypot(0.5, 2.0), 1e-7) << "nearest to the rims";
}

TEST(NearestSign, IsKnownForClosedMeshesOnly) {
  const auto has_sign = [](TriangleMesh mesh) {
    Scene scene;
    scene.place(std::move(mesh));
    const NeighborTruth truth = only(scene, at_point({0.1f, 0.2f, 0.3f}), NearestTarget::surface, true);
    EXPECT_EQ(truth.distance_m < 0.0, truth.has_sign);
    return truth.has_sign;
  };
  EXPECT_TRUE(has_sign(make_box({2, 2, 2})));
  EXPECT_TRUE(has_sign(make_cylinder(1.0, 2.0, 7)));
  TriangleMesh open = make_box({2, 2, 2});
  open.triangles.pop_back();
  EXPECT_FALSE(has_sign(open));
  TriangleMesh one_turned = make_box({2, 2, 2});
  std::swap(one_turned.triangles[3].x, one_turned.triangles[3].y);
  EXPECT_FALSE(has_sign(one_turned));
  TriangleMesh all_turned = make_box({2, 2, 2});
  for (glm::uvec3& triangle : all_turned.triangles)
    std::swap(triangle.x, triangle.y);
  EXPECT_TRUE(has_sign(all_turned));
  // Corners are shared by position, not by index.
  TriangleMesh unshared;
  const TriangleMesh box = make_box({2, 2, 2});
  for (const glm::uvec3& triangle : box.triangles) {
    const auto first = static_cast<std::uint32_t>(unshared.positions_m.size());
    for (int i = 0; i < 3; ++i)
      unshared.positions_m.push_back(box.positions_m[triangle[i]]);
    unshared.triangles.emplace_back(first, first + 1, first + 2);
  }
  EXPECT_TRUE(has_sign(unshared));
}

TEST(NearestSign, IsPositiveInACavity) {
  TriangleMesh mesh = make_box({4, 4, 4});
  const TriangleMesh hollow = make_box({2, 2, 2});
  for (const glm::uvec3& triangle : hollow.triangles)
    mesh.triangles.emplace_back(triangle.y + 8, triangle.x + 8, triangle.z + 8);
  ASSERT_EQ(mesh.positions_m.size(), 8u);
  mesh.positions_m.insert(mesh.positions_m.end(), hollow.positions_m.begin(), hollow.positions_m.end());
  Scene scene;
  scene.place(mesh);
  EXPECT_NEAR(only(scene, at_point({}), NearestTarget::surface, true).distance_m, 1.0, 1e-12);
  EXPECT_NEAR(only(scene, at_point({0, 1.25f, 0}), NearestTarget::surface, true).distance_m, -0.25, 1e-12);
}

TEST(NearestList, IsOrderedAndWithinTheRadius) {
  Scene scene;
  const GeometryId box = scene.add(make_box({2, 2, 2}));
  for (int i = 0; i < 6; ++i)
    scene.place(box, at({4.0 * (i % 3 == 0 ? 5 - i : i + 1), 0, 0}));  // 20, 8, 12, 8, 20, 24
  const auto found = [&](std::uint32_t k, float radius_m) {
    Nearest point = at_point({});
    point.radius_m = radius_m;
    std::vector<std::uint32_t> indices;
    for (const NeighborTruth& truth :
         nearest(scene.world(), point, nearest_options(NearestTarget::bounds, k)))
      indices.push_back(truth.entity.index);
    return indices;
  };
  using Indices = std::vector<std::uint32_t>;
  EXPECT_EQ(found(32, 1e9f), (Indices{1, 3, 2, 0, 4, 5}));
  EXPECT_EQ(found(4, 1e9f), (Indices{1, 3, 2, 0}));
  EXPECT_EQ(found(1, 1e9f), (Indices{1}));
  EXPECT_EQ(found(32, 11.0f), (Indices{1, 3, 2}));
  EXPECT_EQ(found(32, 10.99f), (Indices{1, 3}));
  EXPECT_EQ(found(32, 0.0f), Indices{});
}

TEST(NearestList, OrdersEquallyFarTrianglesByIndex) {
  Scene scene;
  scene.place(make_box({2, 2, 2}));
  scene.place(GeometryId{0});
  const auto truth =
      nearest(scene.world(), at_point({2, 3, 4}), nearest_options(NearestTarget::triangle, 32));
  ASSERT_EQ(truth.size(), 24u);
  std::size_t at_corner = 0;
  while (at_corner < 24 && truth[at_corner].distance_m < std::sqrt(14.0) + 1e-9)
    ++at_corner;
  EXPECT_GE(at_corner, 6u);
  EXPECT_TRUE(std::is_sorted(truth.begin(), truth.begin() + static_cast<std::ptrdiff_t>(at_corner),
                             [](const NeighborTruth& a, const NeighborTruth& b) {
                               return std::tuple(a.entity.index, a.triangle) <
                                      std::tuple(b.entity.index, b.triangle);
                             }));
}

TEST(NearestMotion, AppliesToEntitiesAndCarriers) {
  Scene scene;
  Motion motion = at({0, 0, 0});
  motion.v_world_mps = {10, 0, 0};
  motion.w_world_radps = {0, 0, glm::half_pi<double>()};
  scene.place(make_box({6, 2, 2}), motion);
  Motion carrier = at({0, 20, 0});
  carrier.q_world = glm::angleAxis(glm::half_pi<double>(), glm::dvec3(0, 0, 1));
  carrier.v_world_mps = {10, 1, 0};
  scene.place(GeometryId{}, carrier);
  // After a second the box is at (10, 0, 0), with its long side along y from -3 to 3.
  Nearest point = at_point({-11, 0, 0.5f}, at_s(1.0));
  point.carrier = scene.last();  // at (10, 21, 0), its x along y: the point is at (10, 10, 0.5)
  const NeighborTruth truth = only(scene, point, NearestTarget::surface);
  EXPECT_NEAR(truth.distance_m, 7.0, 1e-12);
  expect_near(truth.p_world_m, {10, 3, 0.5});
  expect_near(truth.v_relative_mps, {-3.0 * glm::half_pi<double>(), -1.0, 0.0});
}

TEST(NearestMask, HidesEntities) {
  Scene scene;
  const GeometryId box = scene.add(make_box({2, 2, 2}));
  scene.place(box, at({3, 0, 0})).mask = 1;
  scene.place(box, at({6, 0, 0})).mask = 2;
  scene.place(GeometryId{}, at({0, 0, 0}));
  Nearest point = at_point({});
  EXPECT_EQ(only(scene, point, NearestTarget::center).entity.index, 0u);
  point.mask = 2;
  EXPECT_EQ(only(scene, point, NearestTarget::center).entity.index, 1u);
  point.mask = mask_all;
  point.excluded = {0, 1};
  EXPECT_EQ(only(scene, point, NearestTarget::surface).entity.index, 1u);
}

TEST(NearestTree, AgreesWithBruteForce) {
  const Scene scene = crowd(72, 60);
  const World world = scene.world();
  Random random(73);
  std::size_t neighbors = 0;
  for (int i = 0; i < 400; ++i) {
    Nearest point = at_point(glm::vec3(8.0 * random.vector()), at_s(random.uniform(10.0, 11.0)));
    if (i % 3 == 0) point.radius_m = static_cast<float>(random.magnitude(0.1, 10.0));
    if (i % 5 == 0) point.mask = 3;
    if (i % 7 == 0) point.carrier = scene.entities[random.below(60)].id;
    const auto target = static_cast<NearestTarget>(i % 4);
    const NearestQueryOptions options =
        nearest_options(target, 1u << (i % 6), target >= NearestTarget::surface);
    const auto truth = nearest(world, point, options);
    const auto slow = nearest_brute_force(world, point, options);
    ASSERT_EQ(truth.size(), slow.size());
    for (std::size_t j = 0; j < truth.size(); ++j) {
      ASSERT_EQ(truth[j].entity, slow[j].entity) << "point " << i << ", place " << j;
      ASSERT_EQ(truth[j].triangle, slow[j].triangle) << "point " << i << ", place " << j;
      ASSERT_EQ(truth[j].distance_m, slow[j].distance_m);
    }
    neighbors += truth.size();
  }
  EXPECT_GT(neighbors, 2000u);
}

}  // namespace
}  // namespace rtstdb::oracle
