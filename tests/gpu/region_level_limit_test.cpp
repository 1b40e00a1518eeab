// Regions by surface and by triangle that pass the limits of the device or of the shader: incomplete, never
// wrong.

#include <algorithm>
#include <cmath>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

using enum RegionShape;
using enum RegionTest;

class RegionLevelLimits : public DatabaseTest {
 protected:
  std::unique_ptr<RegionQuery> prepare(RegionLevel level, std::uint32_t ids_per_region) {
    auto query = database().prepare(RegionQueryOptions{
        .name = "regions", .capacity = 70, .level = level, .ids_per_region = ids_per_region});
    EXPECT_TRUE(query.ok());
    return std::move(query).value();
  }
  Outcome ask(RegionQuery& query, std::uint32_t count) {
    return execute([&](Transaction& transaction) { transaction.add_query(query, count); });
  }
};

/// A region about ever larger balls: listed, overflowing and only counted.
TEST_F(RegionLevelLimits, ABallIsFoundWholeOrNotAnswered) {
  const auto few = prepare(RegionLevel::triangle, 64);
  const auto all = prepare(RegionLevel::triangle, 1u << 16);
  const auto none = prepare(RegionLevel::triangle, 0);
  const auto surfaces = prepare(RegionLevel::surface, 4);
  std::size_t whole = 0;
  std::size_t cut_short = 0;
  EntityId before;
  for (const std::uint32_t subdivisions : {3u, 5u, 6u, 7u, 8u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(make_sphere(1.0, subdivisions))));
    const std::uint32_t count = 20u << 2 * subdivisions;
    for (RegionQuery* query : {few.get(), all.get(), none.get(), surfaces.get()}) {
      query->regions()[0] = region_of(box, touching, {}, glm::vec3(2.0f));
      // Across all of it, so that nothing lies within for certain.
      query->regions()[1] = region_of(sphere, touching, {}, glm::vec3(1.0f));
      query->regions()[2] = region_of(box, touching, {1.0f, 0.0f, 0.0f}, glm::vec3(1e-4f));
      ask(*query, 3);
      EXPECT_FALSE(query->answers()[2].incomplete) << "a short search beside long ones";
      EXPECT_GE(query->answers()[2].found, 1u);
      for (int i = 0; i < 2; ++i) {
        const RegionAnswer& answer = query->answers()[i];
        (answer.incomplete ? cut_short : whole) += 1;
        // To put the lowest in order takes most.
        EXPECT_FALSE(answer.incomplete && count <= (query == few.get() ? 5'120u : 20'480u)) << count;
        for (std::size_t k = 1; k < answer.triangles.size(); ++k)
          ASSERT_LT(answer.triangles[k - 1].triangle, answer.triangles[k].triangle);
        if (!answer.triangles.empty()) {
          EXPECT_LT(answer.triangles.back().triangle, count);
        }
        if (query == few.get() && count <= 20'480) {
          EXPECT_EQ(answer.found, count) << "counted, whatever is listed";
        }
        if (answer.incomplete) continue;
        EXPECT_EQ(answer.found, query == surfaces.get() ? 1u : count);
        EXPECT_EQ(answer.overflow,
                  (query == few.get() && count > 64) || (query == all.get() && count > 1u << 16));
        for (std::uint32_t k = 0; k < answer.triangles.size(); ++k)
          ASSERT_EQ(answer.triangles[k], (EntityTriangle{before, k}));
      }
      EXPECT_FALSE(query == none.get() && query->answers()[0].incomplete && count <= 400'000)
          << "what lies within is counted by the leaf";
      EXPECT_FALSE(query == surfaces.get() && query->answers()[0].incomplete) << "one triangle is enough";
    }
  }
  EXPECT_GT(whole, 20u);
  EXPECT_GT(cut_short, 0u) << "no search came to the limit";
}

/// A plate through a mesh of more than a million triangles, first and last ones among those that it cuts.
TEST_F(RegionLevelLimits, ALargeMeshIsListedInOrder) {
  const TriangleMesh mesh = make_sphere(1.0, 8);
  const EntityId entity = create(row_of(add(mesh)));
  const float height_m = 0.3f;
  std::vector<EntityTriangle> wanted;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& corners = mesh.triangles[i];
    const auto [low, high] = std::minmax(
        {mesh.positions_m[corners.x].z, mesh.positions_m[corners.y].z, mesh.positions_m[corners.z].z});
    if (low <= height_m && height_m <= high) wanted.push_back({entity, i});
  }
  ASSERT_GT(wanted.back().triangle - wanted.front().triangle, 1u << 20);
  const auto query = prepare(RegionLevel::triangle, 8'192);
  query->regions()[0] = region_of(box, touching, {0.0f, 0.0f, height_m}, {2.0f, 2.0f, 0.0f});
  EXPECT_EQ(ask(*query, 1).status, Status::committed);
  EXPECT_TRUE(std::ranges::equal(query->answers()[0].triangles, wanted));
}

/// On lavapipe eight neighbours in the batch share one allowance of rounds. Whether a region is answered must
/// not depend on them.
TEST_F(RegionLevelLimits, ABatchOfLongSearchesIsAnsweredAsEachAlone) {
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
    ask(*query, 64);
    std::vector<RegionAnswer> together(query->answers().begin(), query->answers().end());
    std::vector<std::vector<EntityTriangle>> triangles;
    triangles.reserve(together.size());
    for (const RegionAnswer& answer : together)
      triangles.emplace_back(answer.triangles.begin(), answer.triangles.end());
    std::size_t whole = 0;
    for (std::size_t i = 0; i < 64; ++i) {
      query->regions()[0] = regions[i];
      ask(*query, 1);
      const RegionAnswer& alone = query->answers()[0];
      ASSERT_EQ(alone.incomplete, together[i].incomplete) << "region " << i;
      if (alone.incomplete) continue;
      EXPECT_EQ(alone.found, together[i].found);
      EXPECT_TRUE(std::ranges::equal(alone.triangles, triangles[i]));
      EXPECT_TRUE(
          std::ranges::all_of(alone.triangles, [&](const auto& one) { return one.entity == entity; }));
      ++whole;
    }
    EXPECT_GT(whole, 30u);
  }
}

TEST_F(RegionLevelLimits, AHeapOfEntitiesIsSearchedWholeOrNotAnswered) {
  open({.max_entities = 40'000});
  const GeometryId cube = add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityId> all;
  bool cut_short = false;
  for (const std::uint32_t count : {500u, 2'000u, 38'000u}) {
    const auto ids = create(std::vector<EntityRow>(count - all.size(), row_of(cube)));
    all.insert(all.end(), ids.begin(), ids.end());
    for (const RegionLevel level : {RegionLevel::surface, RegionLevel::triangle}) {
      const auto query = prepare(level, 100);
      query->regions()[0] = region_of(box, touching, {}, glm::vec3(2.0f));
      query->regions()[1] = region_of(box, touching, {9.0f, 0.0f, 0.0f}, glm::vec3(2.0f));
      EXPECT_EQ(ask(*query, 2).status, Status::truncated);
      EXPECT_EQ(query->answers()[1].found, 0u);
      EXPECT_FALSE(query->answers()[1].incomplete);
      const RegionAnswer& answer = query->answers()[0];
      cut_short = cut_short || answer.incomplete;
      EXPECT_FALSE(answer.incomplete && count == 500);
      if (answer.incomplete) continue;
      EXPECT_EQ(answer.found, level == RegionLevel::surface ? count : 12 * count);
      if (level == RegionLevel::surface) {
        EXPECT_TRUE(std::ranges::equal(answer.entities, std::span(all).first(100)));
        continue;
      }
      for (std::uint32_t k = 0; k < 100; ++k)
        EXPECT_EQ(answer.triangles[k], (EntityTriangle{all[k / 12], k % 12}));
    }
  }
  EXPECT_TRUE(cut_short) << "no search came to the limit";
}

}  // namespace
}  // namespace rtstdb::test
