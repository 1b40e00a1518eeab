#include <gtest/gtest.h>

#include <algorithm>

#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

Region box_at(const glm::vec3& center_m, const glm::vec3& half_extent_m) {
  Region region;
  region.center_m = center_m;
  region.half_extent_m = half_extent_m;
  return region;
}

Region sphere_at(const glm::vec3& center_m, float radius_m) {
  Region region = box_at(center_m, glm::vec3(radius_m));
  region.shape = RegionShape::sphere;
  return region;
}

double only_gap(const Scene& scene, const Region& region) {
  const auto all = gaps(scene.world(), region);
  EXPECT_EQ(all.size(), 1u);
  return all.at(0).gap_m;
}

Scene one_box(const Motion& motion = {}) {
  Scene scene;
  scene.place(make_box({2, 2, 2}), motion);
  return scene;
}

TEST(RegionBox, IncludesTouchingEntities) {
  const Scene scene = one_box();
  EXPECT_EQ(only_gap(scene, box_at({3, 0, 0}, {2, 2, 2})), 0.0);  // face on face
  EXPECT_EQ(only_gap(scene, box_at({3, 3, 3}, {2, 2, 2})), 0.0);  // corner on corner
  EXPECT_EQ(found(gaps(scene.world(), box_at({3, 3, 3}, {2, 2, 2}))).size(), 1u);
  EXPECT_EQ(only_gap(scene, box_at({4, 0, 0}, {2, 2, 2})), 1.0);
  EXPECT_TRUE(found(gaps(scene.world(), box_at({4, 0, 0}, {2, 2, 2}))).empty());
  EXPECT_EQ(only_gap(scene, box_at({0, 0, 0}, {0, 0, 0})), -1.0);  // a point in the middle
}

TEST(RegionBox, HasAnOrientation) {
  const Scene scene = one_box();
  Region region = box_at({3, 0, 0}, {1, 1, 1});
  EXPECT_NEAR(only_gap(scene, region), 1.0, 1e-12);
  region.q = glm::angleAxis(static_cast<float>(pi / 4), glm::vec3(0, 0, 1));
  EXPECT_NEAR(only_gap(scene, region), 2.0 - std::sqrt(2.0), 1e-6);  // its edge is closer
  region.q *= 7.0f;                                                  // the length is ignored
  EXPECT_NEAR(only_gap(scene, region), 2.0 - std::sqrt(2.0), 1e-6);
}

TEST(RegionBox, InsideMeansEveryCorner) {
  const Scene scene = one_box();
  Region region = box_at({0.5f, 0, 0}, {1.5f, 1, 1});
  region.test = RegionTest::inside;
  EXPECT_EQ(only_gap(scene, region), 0.0);
  region.center_m.x = 0.75f;
  EXPECT_EQ(only_gap(scene, region), 0.25);
  region = box_at({0, 0, 0}, {1.2f, 1.2f, 1.2f});
  region.test = RegionTest::inside;
  EXPECT_LT(only_gap(scene, region), 0.0);
  region.q = glm::angleAxis(static_cast<float>(pi / 4), glm::vec3(0, 0, 1));
  EXPECT_NEAR(only_gap(scene, region), std::sqrt(2.0) - 1.2, 1e-6);
}

TEST(RegionSphere, IsMeasuredToFacesEdgesAndCorners) {
  const Scene scene = one_box();
  EXPECT_EQ(only_gap(scene, sphere_at({3, 0, 0}, 2)), 0.0);
  EXPECT_NEAR(only_gap(scene, sphere_at({2, 2, 0}, 1)), std::sqrt(2.0) - 1.0, 1e-12);
  EXPECT_NEAR(only_gap(scene, sphere_at({2, 2, 2}, 1)), std::sqrt(3.0) - 1.0, 1e-12);
  EXPECT_EQ(only_gap(scene, sphere_at({0.75f, 0, 0}, 1)), -1.25);
}

TEST(RegionSphere, InsideMeansTheFarthestCorner) {
  const Scene scene = one_box();
  Region region = sphere_at({1, 0, 0}, 3);
  region.test = RegionTest::inside;
  EXPECT_NEAR(only_gap(scene, region), std::sqrt(6.0) - 3.0, 1e-12);
  region.half_extent_m.x = 2.0f;
  EXPECT_NEAR(only_gap(scene, region), std::sqrt(6.0) - 2.0, 1e-12);
}

TEST(Region, TestsScaledBoundsAtItsTime) {
  Motion motion = at({0, 0, 1});
  motion.v_world_mps = {10, 0, 0};
  motion.w_world_radps = {0, 0, pi / 2};
  Scene scene = one_box(motion);
  scene.entities[0].row.scale = {3, 1, 1};
  Region region = box_at({20, 0, 1}, {1, 1, 1});
  region.t = at_s(1.0);  // now at x = 10, with its long side along y
  EXPECT_NEAR(only_gap(scene, region), 10.0 - 1.0 - 1.0, 1e-9);
  region.t = at_s(2.0);  // now at x = 20, along x again
  EXPECT_NEAR(only_gap(scene, region), -2.0, 1e-9);
}

TEST(Region, MovesWithItsCarrier) {
  Motion car = at({0, 0, 0});
  car.v_world_mps = {10, 0, 0};
  car.w_world_radps = {0, 0, pi / 2};
  Scene scene;
  scene.place(make_box({1, 1, 1}), car).mask = 1;
  const EntityId carrier = scene.last();
  scene.place(make_box({2, 2, 2}), at({10, 8, 0})).mask = 2;
  Region ahead = box_at({4, 0, 0}, {2, 1, 1});
  ahead.carrier = carrier;
  ahead.mask = 2;
  ahead.t = at_s(1.0);  // the car is at x = 10 and looks along y: the zone reaches from y = 2 to 6
  EXPECT_NEAR(only_gap(scene, ahead), 1.0, 1e-9);
  ahead.center_m.x = 5.0f;
  EXPECT_NEAR(only_gap(scene, ahead), 0.0, 1e-9);
}

TEST(Region, IgnoresMaskedEntities) {
  Scene scene;
  for (const std::uint32_t mask : {1u, 2u, 3u, 0u})
    scene.place(make_box({1, 1, 1})).mask = mask;
  Region region = box_at({0, 0, 0}, {1, 1, 1});
  region.mask = 2;
  const auto ids = found(gaps(scene.world(), region));
  ASSERT_EQ(ids.size(), 2u);
  EXPECT_EQ(ids[0].index, 1u);
  EXPECT_EQ(ids[1].index, 2u);
}

/// The nearest point of a box, by its frame.
glm::dvec3 nearest_in(const OrientedBox& box, const glm::dvec3& p) {
  glm::dvec3 nearest = box.center_m;
  for (int i = 0; i < 3; ++i)
    nearest += box.axis[i] * std::clamp(glm::dot(box.axis[i], p - box.center_m), -box.half_extent_m[i],
                                        box.half_extent_m[i]);
  return nearest;
}

/// Distance of two boxes by alternating projections, independent of separating axes.
double distance_by_projection(const OrientedBox& a, const OrientedBox& b) {
  glm::dvec3 p = a.center_m;
  double distance = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const glm::dvec3 q = nearest_in(b, p);
    p = nearest_in(a, q);
    distance = glm::length(p - q);
    if (distance < 1e-9) break;
  }
  return distance;
}

TEST(Overlap, AgreesWithAlternatingProjections) {
  Random random(1);
  int apart = 0;
  int together = 0;
  for (int i = 0; i < 1500; ++i) {
    Scene scene;
    for (int k = 0; k < 2; ++k) {
      EntityRow& row = scene.place(make_box({1, 1, 1}), at(0.7 * random.vector()));
      row.motion.q_world = random.orientation();
      row.scale = {random.magnitude(0.05, 4), random.magnitude(0.05, 4), random.magnitude(0.05, 4)};
    }
    const World world = scene.world();
    const auto all = gaps(world, Overlap{scene.entities[0].id, {}, mask_all});
    ASSERT_EQ(all.size(), 1u);
    const double gap = all[0].gap_m;
    const auto box_of = [&](std::size_t which) {
      const EntityState& state = scene.entities[which];
      return oriented_box(world.mesh_of(state).bounds(), state.row.scale, pose_at(state.row.motion, {}));
    };
    const double distance = distance_by_projection(box_of(0), box_of(1));
    if (gap > 0.0) {
      ++apart;
      // The best axis gives at most the distance, and at least a third of it.
      EXPECT_LE(gap, distance + 1e-6);
      EXPECT_GE(gap, distance / 3.0 - 1e-6);
    } else if (gap < -1e-3) {
      ++together;
      EXPECT_LT(distance, 1e-3);
    }
  }
  EXPECT_GT(apart, 200);
  EXPECT_GT(together, 200);
}

TEST(Overlap, FindsEdgesThatOnlyACrossedAxisSeparates) {
  // Two crossed bars, one above the other, each on its edge.
  Scene scene;
  const glm::dquat on_edge = glm::angleAxis(pi / 4, glm::dvec3(1, 0, 0));
  EntityRow& lower = scene.place(make_box({10, 1, 1}));
  lower.motion.q_world = on_edge;
  EntityRow& upper = scene.place(make_box({10, 1, 1}), at({0, 0, 1.5}));
  upper.motion.q_world = glm::angleAxis(pi / 2, glm::dvec3(0, 0, 1)) * on_edge;
  const auto all = gaps(scene.world(), Overlap{scene.entities[0].id, {}, mask_all});
  EXPECT_NEAR(all.at(0).gap_m, 1.5 - std::sqrt(2.0), 1e-12);
}

TEST(Overlap, IsSymmetricAndExcludesItself) {
  const Scene scene = crowd(3, 100);
  const World world = scene.world();
  std::vector<std::vector<EntityGap>> rows;
  for (const EntityState& state : scene.entities)
    rows.push_back(gaps(world, Overlap{state.id, at_s(10.4), mask_all}));
  int overlaps = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), rows.size() - 1);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (i == k) continue;
      const EntityGap& forward = rows[i][k < i ? k : k - 1];
      const EntityGap& backward = rows[k][i < k ? i : i - 1];
      EXPECT_EQ(forward.entity, scene.entities[k].id);
      EXPECT_NEAR(forward.gap_m, backward.gap_m, 1e-9);
      overlaps += forward.gap_m <= 0.0;
    }
  }
  EXPECT_GT(overlaps, 4);
}

TEST(Overlap, IncludesTouchingEntitiesAndIgnoresMaskedOnes) {
  Scene scene;
  scene.place(make_box({2, 2, 2}), at({0, 0, 0})).mask = 1;
  scene.place(make_box({2, 2, 2}), at({2, 0, 0})).mask = 2;
  scene.place(make_box({2, 2, 2}), at({0, 2, 2})).mask = 4;
  const World world = scene.world();
  EXPECT_EQ(found(gaps(world, Overlap{scene.entities[0].id, {}, mask_all})).size(), 2u);
  EXPECT_EQ(found(gaps(world, Overlap{scene.entities[0].id, {}, 4})).size(), 1u);
  EXPECT_TRUE(found(gaps(world, Overlap{scene.entities[0].id, {}, 1})).empty());
}

TEST(Overlap, WorksWithFlatBounds) {
  Scene scene;
  scene.place(make_rectangle(4, 4));
  scene.place(make_box({1, 1, 1}), at({0, 0, 0.5}));
  scene.place(make_rectangle(1, 1), at({1, 1, 0}));
  scene.place(make_rectangle(1, 1), at({1, 1, 0.25}));
  const auto all = gaps(scene.world(), Overlap{scene.entities[0].id, {}, mask_all});
  EXPECT_EQ(all[0].gap_m, 0.0);
  EXPECT_EQ(all[1].gap_m, 0.0);
  EXPECT_EQ(all[2].gap_m, 0.25);
}

TEST(RegionDeathTest, InvalidElementsAreMisuse) {
  const World world = one_box().world();
  Region region = box_at({0, 0, 0}, {1, -1, 1});
  EXPECT_DEATH(gaps(world, region), "a half extent of the region is negative");
  region = box_at({0, 0, 0}, {1, 1, 1});
  region.carrier = {7, 1};
  EXPECT_DEATH(gaps(world, region), "the carrier does not exist");
  EXPECT_DEATH(gaps(world, Overlap{{7, 1}, {}, mask_all}), "the entity does not exist, or has no geometry");
}

}  // namespace
}  // namespace rtstdb::oracle
