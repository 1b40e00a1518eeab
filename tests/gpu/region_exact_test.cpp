// Region queries whose answers follow from the construction of the world: regions that touch exactly, lists
// that overflow, empty worlds and empty batches.

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "tests/gpu/database_fixture.hpp"

namespace rtstdb::test {
namespace {

using enum RegionShape;
using enum RegionTest;

constexpr RegionLevel all_levels[] = {RegionLevel::bounds, RegionLevel::surface, RegionLevel::triangle};

class RegionQueries : public DatabaseTest {
 protected:
  std::unique_ptr<RegionQuery> prepare(RegionLevel level, std::uint32_t ids_per_region,
                                       std::uint32_t capacity = 2) {
    return DatabaseTest::prepare(RegionQueryOptions{
        .name = "regions", .capacity = capacity, .level = level, .ids_per_region = ids_per_region});
  }
  RegionAnswer answer_of(RegionQuery& query, const Region& region) {
    query.regions()[0] = region;
    EXPECT_EQ(run(query, 1).status, Status::committed);
    return query.answers()[0];
  }
  static Region everywhere() { return region_of(box, touching, {}, glm::vec3(1e4f)); }
};

TEST_F(RegionQueries, FindWhatTheyTouchExactly) {
  create(row_of(add({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}})));
  const auto box_at = [](const glm::vec3& center_m, float half_m) {
    return region_of(box, touching, center_m, glm::vec3(half_m));
  };
  const auto box_inside = [](const glm::vec3& half_m) {
    return region_of(box, inside, {0.5f, 0.5f, 0.0f}, half_m);
  };
  const auto ball = [](RegionTest test, const glm::vec3& center_m, float radius_m) {
    return region_of(sphere, test, center_m, {radius_m, 0.0f, 0.0f});
  };
  // At the far plane, 2 m from the eye, the view reaches 2 m to the left and right and 1 m up and down.
  const auto view = [](RegionTest test, const glm::vec3& eye_m, float near_m = 0.0f) {
    Region region = region_of(frustum, test, eye_m, {2.0f, 2.0f, 1.0f});
    region.near_m = near_m;
    return region;
  };
  const struct {
    const char* name;
    Region region;
    bool finds_bounds, finds_triangle;
  } rows[] = {
      {"box, corner on corner", box_at({-0.5f, -0.5f, -0.5f}, 0.5f), true, true},
      {"box, short of the corner", box_at({-0.5f, -0.5f, -0.5f}, 0.4995f), false, false},
      {"box, corner on the slanted edge", box_at({1.0f, 1.0f, 0.0f}, 0.5f), true, true},
      {"box, short of the slanted edge", box_at({1.0f, 1.0f, 0.0f}, 0.4995f), true, false},
      {"box, on the face", box_at({0.25f, 0.25f, 0.125f}, 0.125f), true, true},
      {"box, above the face", box_at({0.25f, 0.25f, 0.1255f}, 0.125f), false, false},
      {"point on the triangle", box_at({0.25f, 0.25f, 0.0f}, 0.0f), true, true},
      {"point beside the triangle", box_at({0.75f, 0.75f, 0.0f}, 0.0f), true, false},
      {"box, inside exactly", box_inside({0.5f, 0.5f, 0.0f}), true, true},
      {"box, inside but for a corner", box_inside({0.4995f, 0.5f, 1.0f}), false, false},
      {"sphere, at a corner", ball(touching, {-3.0f, -4.0f, 0.0f}, 5.0f), true, true},
      {"sphere, short of the corner", ball(touching, {-3.0f, -4.0f, 0.0f}, 4.9995f), false, false},
      {"sphere, at an edge", ball(touching, {0.5f, -3.0f, 4.0f}, 5.0f), true, true},
      {"sphere, inside exactly", ball(inside, {0.0f, 0.0f, 0.0f}, 1.0f), false, true},
      {"frustum, ends at the corner", view(touching, {-2.0f, 0.0f, 0.0f}), true, true},
      {"frustum, ends before the corner", view(touching, {-2.0005f, 0.0f, 0.0f}), false, false},
      {"frustum, begins at the corner", view(touching, {0.5f, 0.0f, 0.0f}, 0.5f), true, true},
      {"frustum, begins behind the corner", view(touching, {0.5f, 0.0f, 0.0f}, 0.5005f), false, false},
      {"frustum, side at the corner", view(touching, {-1.0f, -2.0f, 0.0f}), true, true},
      {"frustum, inside exactly", view(inside, {-1.0f, 0.0f, 0.0f}, 1.0f), true, true},
  };
  for (const RegionLevel level : all_levels) {
    const auto query = prepare(level, 1);
    for (const auto& row : rows) {
      const bool finds = level == RegionLevel::bounds ? row.finds_bounds : row.finds_triangle;
      EXPECT_EQ(answer_of(*query, row.region).found, finds ? 1u : 0u) << row.name << ", " << to_string(level);
    }
  }
}

/// The listed entities as triangles with number 0, or the listed triangles.
std::vector<EntityTriangle> list_of(const RegionAnswer& answer) {
  std::vector<EntityTriangle> list(answer.triangles.begin(), answer.triangles.end());
  for (const EntityId entity : answer.entities)
    list.push_back({entity, 0});
  return list;
}

/// 2500 entities are more than one workgroup builds a tree of.
TEST_F(RegionQueries, ListTheLowestIdsAndTheTrueCountOnOverflow) {
  for (const auto& [level, entities] : {std::pair(RegionLevel::bounds, 100u),
                                        {RegionLevel::bounds, 2500u},
                                        {RegionLevel::surface, 60u},
                                        {RegionLevel::triangle, 60u}}) {
    open({});
    const GeometryId ball = add(make_sphere(1.0, 2)), cube = add(make_box({1.0, 1.0, 1.0}));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < entities; ++i)
      rows.push_back(row_of(i % 3 == 0 ? ball : cube, {3.0 * ((i * 37) % entities), 0.0, 0.0}));
    const auto ids = create(rows);
    std::vector<EntityTriangle> all;
    for (std::uint32_t i = 0; i < entities; ++i) {
      const std::uint32_t triangles = level != RegionLevel::triangle ? 1 : i % 3 == 0 ? 320 : 12;
      for (std::uint32_t k = 0; k < triangles; ++k)
        all.push_back({ids[i], k});
    }
    const auto size = static_cast<std::uint32_t>(all.size());
    const std::uint32_t in_first_ball = level == RegionLevel::triangle ? 320 : 1;
    // The second region finds the ball at the origin alone.
    const Region regions[] = {everywhere(), region_of(box, touching, {}, glm::vec3(1.4f))};
    for (const std::uint32_t capacity : {1u, 2u, 17u, 59u, size - 1, size}) {
      SCOPED_TRACE(testing::Message()
                   << to_string(level) << " of " << entities << " entities, lists of " << capacity);
      const auto query = prepare(level, capacity);
      std::ranges::copy(regions, query->regions().begin());
      EXPECT_EQ(run(*query, 2).status, capacity < size ? Status::truncated : Status::committed);
      const std::uint32_t expected[] = {size, in_first_ball};
      for (std::size_t i = 0; i < 2; ++i) {
        const RegionAnswer& answer = query->answers()[i];
        EXPECT_EQ(answer.found, expected[i]);
        EXPECT_EQ(answer.overflow, capacity < expected[i]);
        EXPECT_FALSE(answer.incomplete);
        EXPECT_TRUE(
            std::ranges::equal(list_of(answer), std::span(all).first(std::min(capacity, expected[i]))));
      }
    }
    EXPECT_EQ(answer_of(*prepare(level, 0), everywhere()).found, size);
  }
}

/// At one instant and over a window of time, which different kernels search.
TEST_F(RegionQueries, OverflowIndependentlyInABatch) {
  const GeometryId cube = add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < 300; ++i)
    rows.push_back(row_of(cube, {2.0 * i, 0.0, 0.0}));
  const auto ids = create(rows);
  constexpr std::uint32_t capacity = 16;
  const auto query = prepare(RegionLevel::bounds, capacity, 300);
  for (const bool at_one_instant : {true, false}) {
    for (std::uint32_t i = 0; i < 300; ++i) {
      // Finds the entities 0 to i.
      Region& region = query->regions()[i];
      region = region_of(box, touching, {i, 0.0f, 0.0f}, {static_cast<float>(i) + 1.0f, 1.0f, 1.0f});
      region.t = at_s(at_one_instant ? 0.0 : 1e-3 * i);
    }
    EXPECT_EQ(run(*query, 300).status, Status::truncated);
    for (std::uint32_t i = 0; i < 300; ++i) {
      const RegionAnswer& answer = query->answers()[i];
      EXPECT_EQ(answer.found, i + 1);
      EXPECT_EQ(answer.overflow, i + 1 > capacity);
      EXPECT_TRUE(std::ranges::equal(answer.entities, std::span(ids).first(std::min(i + 1, capacity)))) << i;
    }
  }
}

TEST_F(RegionQueries, FindNothingInEmptyWorldsAndHaveNoAnswersForEmptyBatches) {
  for (const RegionLevel level : all_levels) {
    SCOPED_TRACE(to_string(level));
    open({});
    const auto query = prepare(level, 64);
    EXPECT_EQ(answer_of(*query, everywhere()).found, 0u);
    create(EntityRow{});
    EXPECT_EQ(answer_of(*query, everywhere()).found, 0u) << "an entity without geometry";
    const EntityId entity = create(row_of(add(make_box({1.0, 1.0, 1.0}))));
    EXPECT_EQ(answer_of(*query, everywhere()).found, level == RegionLevel::triangle ? 12u : 1u);
    EXPECT_EQ(run(*query, 0).status, Status::committed);
    EXPECT_TRUE(query->answers().empty());
    remove(entity, {});
    EXPECT_EQ(answer_of(*query, everywhere()).found, 0u);
  }
}

}  // namespace
}  // namespace rtstdb::test
