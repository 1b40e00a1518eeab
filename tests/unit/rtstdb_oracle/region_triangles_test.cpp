// Regions by triangle compared with closed forms and with random points.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "rtstdb/oracle/polyhedron.hpp"
#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

Region region_of(RegionShape shape, RegionTest test, const glm::vec3& center_m,
                 const glm::vec3& half_extent_m) {
  Region region;
  region.shape = shape;
  region.test = test;
  region.center_m = center_m;
  region.half_extent_m = half_extent_m;
  return region;
}

std::vector<std::uint32_t> numbers(const Scene& scene, const Region& region) {
  std::vector<std::uint32_t> all;
  for (const EntityTriangle& one : found(triangle_gaps(scene.world(), region))) {
    EXPECT_EQ(one.entity, scene.last());
    all.push_back(one.triangle);
  }
  return all;
}

using Numbers = std::vector<std::uint32_t>;
using enum RegionShape;
using enum RegionTest;

/// The triangle (0, 0, 0), (1, 0, 0), (0, 1, 0), a line along (1, 1, 1) and a point.
Scene triangle_line_and_point() {
  Scene scene;
  scene.place({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {4, 4, 4}, {6, 6, 6}, {9, 9, 9}},
               {{0, 1, 2}, {3, 4, 3}, {5, 5, 5}}});
  return scene;
}

TEST(RegionTriangles, IncludesTouchingTriangles) {
  const Scene scene = triangle_line_and_point();
  EXPECT_EQ(numbers(scene, region_of(box, touching, {-1, -1, -1}, {1, 1, 1})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(box, touching, {1, 1, 0}, {0.5f, 0.5f, 0.5f})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(box, touching, {1, 1, 0}, {0.49f, 0.5f, 0.5f})), Numbers{});
  EXPECT_EQ(numbers(scene, region_of(box, touching, {0.25f, 0.25f, 1}, {0, 0, 1})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(sphere, touching, {-3, -4, 0}, {5, 0, 0})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(frustum, touching, {-2, 0, 0}, {2, 1, 1})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(frustum, touching, {-2.01f, 0, 0}, {2, 1, 1})), Numbers{});
  EXPECT_EQ(numbers(scene, region_of(box, touching, {5, 5, 4.5f}, {0.25f, 0.25f, 0.25f})), Numbers{1});
  EXPECT_EQ(numbers(scene, region_of(box, touching, {5, 5, 4.4f}, {0.25f, 0.25f, 0.25f})), Numbers{});
  EXPECT_EQ(numbers(scene, region_of(box, touching, {8, 8, 8}, {1, 1, 1})), Numbers{2});
  EXPECT_EQ(numbers(scene, region_of(box, touching, {0, 0, 0}, {99, 99, 99})), (Numbers{0, 1, 2}));
}

TEST(RegionTriangles, InsideMeansEveryCorner) {
  const Scene scene = triangle_line_and_point();
  EXPECT_EQ(numbers(scene, region_of(box, inside, {0.5f, 0.5f, 0}, {0.5f, 0.5f, 0})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(box, inside, {0.5f, 0.5f, 0}, {0.5f, 0.4f, 1})), Numbers{});
  EXPECT_EQ(numbers(scene, region_of(sphere, inside, {0, 0, 0}, {1, 0, 0})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(sphere, inside, {0, 0, 0}, {0.99f, 0, 0})), Numbers{});
  EXPECT_EQ(numbers(scene, region_of(frustum, inside, {-1, 0, 0}, {2, 2, 1})), Numbers{0});
  EXPECT_EQ(numbers(scene, region_of(frustum, inside, {-0.99f, 0, 0}, {2, 2, 1})), Numbers{});
}

TEST(RegionTriangles, GapsAreLengths) {
  const Scene scene = triangle_line_and_point();
  const auto gap_m = [&](const Region& region) { return triangle_gaps(scene.world(), region).at(0).gap_m; };
  EXPECT_NEAR(gap_m(region_of(box, touching, {0.25f, 0.25f, 0.5f}, {0.1f, 0.1f, 0.75f})), -0.25, 1e-6);
  EXPECT_NEAR(gap_m(region_of(sphere, touching, {0.25f, 0.25f, 0.5f}, {0.75f, 0, 0})), -0.25, 1e-6);
  EXPECT_NEAR(gap_m(region_of(box, inside, {0.5f, 0.5f, 0}, {0.75f, 0.75f, 0.125f})), -0.125, 1e-6);
  // The far face is 0.5 beyond the corner.
  EXPECT_NEAR(gap_m(region_of(frustum, touching, {-2, 0, 0}, {2.5f, 99, 99})), -0.5, 1e-6);
}

TEST(RegionTriangles, UsesPoseScaleCarrierAndMask) {
  Motion motion = at({0, 0, 1});
  motion.v_world_mps = {10, 0, 0};
  motion.w_world_radps = {0, 0, pi / 2};
  Scene scene;
  scene.place(GeometryId{}, motion);
  const EntityId carrier = scene.last();
  EntityRow& row = scene.place(TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}, motion);
  row.scale = {3, 1, 1};
  row.mask = 4;
  // At one second it is at x = 10, with its long side along y to 3.
  Region region = region_of(sphere, touching, {10, 5, 1}, {2.001f, 0, 0});
  region.t = at_s(1.0);
  EXPECT_EQ(numbers(scene, region), Numbers{0});
  region.half_extent_m.x = 1.999f;
  EXPECT_EQ(numbers(scene, region), Numbers{});
  region = region_of(sphere, touching, {5, 0, 0}, {2.001f, 0, 0});
  region.carrier = carrier;
  region.t = at_s(0.7);
  EXPECT_EQ(numbers(scene, region), Numbers{0});
  region.mask = 3;
  EXPECT_EQ(numbers(scene, region), Numbers{});
}

TEST(RegionSurfaces, TouchWithOneTriangleAndAreInsideWithAll) {
  Scene scene;
  scene.place(make_sphere(1.0, 3));
  const auto count = [&](const Region& region) { return found(surface_gaps(scene.world(), region)).size(); };
  EXPECT_EQ(count(region_of(box, touching, {}, {0.3f, 0.3f, 0.3f})), 0u) << "the interior does not count";
  EXPECT_EQ(count(region_of(box, touching, {1, 0, 0}, {0.3f, 0.3f, 0.3f})), 1u);
  EXPECT_EQ(count(region_of(box, inside, {1, 0, 0}, {0.3f, 0.3f, 0.3f})), 0u);
  EXPECT_EQ(count(region_of(sphere, inside, {}, {1.001f, 0, 0})), 1u);
  EXPECT_EQ(count(region_of(sphere, inside, {}, {0.999f, 0, 0})), 0u);
  EXPECT_EQ(count(region_of(sphere, touching, {50, 0, 0}, {1, 0, 0})), 0u);
  EXPECT_EQ(surface_gaps(scene.world(), region_of(sphere, touching, {50, 0, 0}, {1, 0, 0})).size(), 1u);
}

/// A common point proves contact; a point of the triangle outside of the region proves that it is not inside;
/// without a common point among many, the overlap is not deep.
TEST(RegionTriangles, AgreesWithRandomPoints) {
  Random random(71);
  int touching_count = 0;
  int apart = 0;
  int within = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    Scene scene;
    const glm::vec3 a(random.vector());
    scene.place({{a, a + glm::vec3(random.magnitude(0.01, 1.5) * random.direction()),
                  a + glm::vec3(random.magnitude(0.01, 1.5) * random.direction())},
                 {{0, 1, 2}}});
    const World world = scene.world();
    Region region =
        region_of(static_cast<RegionShape>(random.below(3)), touching, glm::vec3(random.vector()),
                  glm::vec3(random.uniform(0.3, 2), random.uniform(0.3, 2), random.uniform(0.3, 2)));
    region.q = glm::quat(random.orientation());
    region.near_m = 0.2f;
    const auto gap = triangle_gaps(world, region);
    region.test = inside;
    const auto inside_gap = triangle_gaps(world, region);
    const auto corners = world.mesh_of(scene.entities[0]).corners(0);
    const glm::dmat3 axes = glm::mat3_cast(glm::normalize(glm::dquat(region.q)));
    const glm::dvec3 half_m(region.half_extent_m);
    bool common = false;
    bool outside = false;
    for (int k = 0; k < 200; ++k) {
      double u = random.uniform(0, 1);
      double v = random.uniform(0, 1);
      if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      const glm::dvec3 p = glm::transpose(axes) * ((1.0 - u - v) * corners[0] + u * corners[1] +
                                                   v * corners[2] - glm::dvec3(region.center_m));
      bool holds = glm::length(p) <= half_m.x;
      if (region.shape == box) holds = glm::all(glm::lessThanEqual(glm::abs(p), half_m));
      if (region.shape == frustum)
        holds = p.x >= 0.2 && p.x <= half_m.x && std::abs(p.y) <= half_m.y * p.x / half_m.x &&
                std::abs(p.z) <= half_m.z * p.x / half_m.x;
      common = common || holds;
      outside = outside || !holds;
    }
    EXPECT_FALSE(common && found(gap).empty());
    EXPECT_FALSE(outside && !found(inside_gap).empty() && inside_gap[0].gap_m < -1e-6);
    EXPECT_FALSE(!common && !gap.empty() && gap[0].gap_m < -0.2) << gap[0].gap_m;
    touching_count += common ? 1 : 0;
    apart += found(gap).empty() ? 1 : 0;
    within += found(inside_gap).empty() ? 0 : 1;
  }
  EXPECT_GT(touching_count, 500);
  EXPECT_GT(apart, 500);
  EXPECT_GT(within, 50);
}

/// Entity 1: triangles inside, inside at the border, outside at the border; entity 3: inside.
std::vector<TriangleGap> four_gaps() {
  return {
      {{1, 1}, 2, -1.0, 1e-4}, {{1, 1}, 5, -1e-5, 1e-4}, {{1, 1}, 6, 1e-5, 1e-4}, {{3, 1}, 0, -1.0, 1e-4}};
}

Verdict verdict_on(const std::vector<EntityTriangle>& triangles, std::uint32_t found, bool overflow = false) {
  RegionAnswer answer;
  answer.triangles = triangles;
  answer.found = found;
  answer.overflow = overflow;
  const Judgement judgement = compare(four_gaps(), answer);
  EXPECT_EQ(judgement.reason.empty(), judgement.verdict == Verdict::agrees) << judgement.reason;
  return judgement.verdict;
}

TEST(CompareRegionTriangles, AgreesIsTooCloseAtTheBorderOrDiffers) {
  const EntityTriangle a{{1, 1}, 2};
  const EntityTriangle b{{1, 1}, 5};
  const EntityTriangle c{{1, 1}, 6};
  const EntityTriangle d{{3, 1}, 0};
  EXPECT_EQ(verdict_on({a, b, d}, 3), Verdict::agrees);
  EXPECT_EQ(verdict_on({a, d}, 2), Verdict::too_close);
  EXPECT_EQ(verdict_on({a, b, c, d}, 4), Verdict::too_close);
  EXPECT_EQ(verdict_on({a, b}, 2), Verdict::differs);
  EXPECT_EQ(verdict_on({b, a, d}, 3), Verdict::differs);
  EXPECT_EQ(verdict_on({a, {{1, 1}, 3}, d}, 3), Verdict::differs);
  EXPECT_EQ(verdict_on({a, b, {{3, 2}, 0}}, 3), Verdict::differs);
  EXPECT_EQ(verdict_on({a, b, d}, 4), Verdict::differs);
  EXPECT_EQ(verdict_on({a}, 3, true), Verdict::agrees);
  EXPECT_EQ(verdict_on({b}, 3, true), Verdict::differs);
  EXPECT_EQ(verdict_on({a}, 7, true), Verdict::differs);
  RegionAnswer answer;
  const EntityId stray{1, 1};
  answer.entities = std::span(&stray, 1);
  EXPECT_EQ(compare(std::span<const TriangleGap>{}, answer).verdict, Verdict::differs);
  answer = {};
  answer.incomplete = true;
  EXPECT_EQ(compare(std::span<const TriangleGap>{}, answer).verdict, Verdict::differs);
}

}  // namespace
}  // namespace rtstdb::oracle
