// Regions of the levels surface and triangle whose searches exceed the limits of the kernel: the answers are
// incomplete, never wrong.

#include <algorithm>
#include <cmath>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

using enum RegionShape;
using enum RegionTest;

class RegionLevelLimits : public DatabaseTest {
 protected:
  std::unique_ptr<RegionQuery> prepare(RegionLevel level, std::uint32_t ids_per_region) {
    return DatabaseTest::prepare(RegionQueryOptions{
        .name = "regions", .capacity = 70, .level = level, .ids_per_region = ids_per_region});
  }
};

/// Around ever larger meshes: complete lists, lists that overflow, and counts.
TEST_F(RegionLevelLimits, LargeMeshesAreFoundCompletelyOrIncomplete) {
  const auto few = prepare(RegionLevel::triangle, 64);
  const auto all = prepare(RegionLevel::triangle, 1u << 16);
  const auto none = prepare(RegionLevel::triangle, 0);
  const auto surfaces = prepare(RegionLevel::surface, 4);
  std::size_t complete = 0;
  std::size_t incomplete = 0;
  EntityId before;
  for (const std::uint32_t subdivisions : {3u, 5u, 6u, 7u, 8u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(make_sphere(1.0, subdivisions))));
    const std::uint32_t count = 20u << 2 * subdivisions;
    for (RegionQuery* query : {few.get(), all.get(), none.get(), surfaces.get()}) {
      query->regions()[0] = region_of(box, touching, {}, glm::vec3(2.0f));
      // It crosses all boxes, so that no node is inside as a whole.
      query->regions()[1] = region_of(sphere, touching, {}, glm::vec3(1.0f));
      query->regions()[2] = region_of(box, touching, {1.0f, 0.0f, 0.0f}, glm::vec3(1e-4f));
      run(*query, 3);
      EXPECT_FALSE(query->answers()[2].incomplete) << "a short search beside long ones";
      EXPECT_GE(query->answers()[2].found, 1u);
      for (int i = 0; i < 2; ++i) {
        const RegionAnswer& answer = query->answers()[i];
        (answer.incomplete ? incomplete : complete) += 1;
        // The search for the lowest triangles takes the most rounds.
        EXPECT_FALSE(answer.incomplete && count <= (query == few.get() ? 5'120u : 20'480u)) << count;
        for (std::size_t k = 1; k < answer.triangles.size(); ++k)
          ASSERT_LT(answer.triangles[k - 1].triangle, answer.triangles[k].triangle);
        if (!answer.triangles.empty()) {
          EXPECT_LT(answer.triangles.back().triangle, count);
        }
        if (query == few.get() && count <= 20'480) {
          EXPECT_EQ(answer.found, count) << "the count does not depend on the list";
        }
        if (answer.incomplete) continue;
        EXPECT_EQ(answer.found, query == surfaces.get() ? 1u : count);
        EXPECT_EQ(answer.overflow,
                  (query == few.get() && count > 64) || (query == all.get() && count > 1u << 16));
        for (std::uint32_t k = 0; k < answer.triangles.size(); ++k)
          ASSERT_EQ(answer.triangles[k], (EntityTriangle{before, k}));
      }
      EXPECT_FALSE(query == none.get() && query->answers()[0].incomplete && count <= 400'000)
          << "leaves inside the region are counted without a test of their triangles";
      EXPECT_FALSE(query == surfaces.get() && query->answers()[0].incomplete) << "one triangle is enough";
    }
  }
  EXPECT_GT(complete, 20u);
  EXPECT_GT(incomplete, 0u) << "no search exceeds the limit";
}

/// A plane through a mesh of more than a million triangles, which crosses low and high triangle numbers.
TEST_F(RegionLevelLimits, TrianglesOfALargeMeshAreListedInOrder) {
  const TriangleMesh mesh = make_sphere(1.0, 8);
  const EntityId entity = create(row_of(add(mesh)));
  const float height_m = 0.3f;
  std::vector<EntityTriangle> expected;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& corners = mesh.triangles[i];
    const auto [low, high] = std::minmax(
        {mesh.positions_m[corners.x].z, mesh.positions_m[corners.y].z, mesh.positions_m[corners.z].z});
    if (low <= height_m && height_m <= high) expected.push_back({entity, i});
  }
  ASSERT_GT(expected.back().triangle - expected.front().triangle, 1u << 20);
  const auto query = prepare(RegionLevel::triangle, 8'192);
  query->regions()[0] = region_of(box, touching, {0.0f, 0.0f, height_m}, {2.0f, 2.0f, 0.0f});
  EXPECT_EQ(run(*query, 1).status, Status::committed);
  EXPECT_TRUE(std::ranges::equal(query->answers()[0].triangles, expected));
}

/// On lavapipe eight neighbouring regions of a batch share a limit of rounds. Whether a region is complete
/// must not depend on the others.
TEST_F(RegionLevelLimits, LongSearchesDoNotDependOnTheBatch) {
  Random random(24);
  const EntityId entity = create(row_of(add(make_sphere(1.0, 7))));
  for (const RegionLevel level : {RegionLevel::surface, RegionLevel::triangle}) {
    const auto query = prepare(level, 16);
    std::vector<Region> regions(64);
    for (Region& region : regions) {
      region = region_of(static_cast<RegionShape>(random.below(3)), random.one_in(3) ? inside : touching,
                         random.direction(), glm::vec3(glm::dvec3(random.magnitude(0.06, 1.5))));
    }
    std::ranges::copy(regions, query->regions().begin());
    run(*query, 64);
    std::vector<RegionAnswer> in_batch(query->answers().begin(), query->answers().end());
    std::vector<std::vector<EntityTriangle>> triangles;
    triangles.reserve(in_batch.size());
    for (const RegionAnswer& answer : in_batch)
      triangles.emplace_back(answer.triangles.begin(), answer.triangles.end());
    std::size_t complete = 0;
    for (std::size_t i = 0; i < 64; ++i) {
      query->regions()[0] = regions[i];
      run(*query, 1);
      const RegionAnswer& alone = query->answers()[0];
      ASSERT_EQ(alone.incomplete, in_batch[i].incomplete) << "region " << i;
      if (alone.incomplete) continue;
      EXPECT_EQ(alone.found, in_batch[i].found);
      EXPECT_TRUE(std::ranges::equal(alone.triangles, triangles[i]));
      EXPECT_TRUE(
          std::ranges::all_of(alone.triangles, [&](const auto& one) { return one.entity == entity; }));
      ++complete;
    }
    EXPECT_GT(complete, 30u);
  }
}

}  // namespace
}  // namespace rtstdb::test
