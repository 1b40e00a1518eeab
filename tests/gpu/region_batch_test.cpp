// Batches with many long lists, which two threads sort, and batches at one instant of consecutive versions.

#include <algorithm>

#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t large_batch = 3000;

struct Answer {
  std::vector<EntityId> entities;
  std::vector<EntityTriangle> triangles;
  std::uint32_t found = 0;
  bool overflow = false, incomplete = false;
  explicit Answer(const RegionAnswer& answer)
      : entities(answer.entities.begin(), answer.entities.end()),
        triangles(answer.triangles.begin(), answer.triangles.end()),
        found(answer.found),
        overflow(answer.overflow),
        incomplete(answer.incomplete) {}
  bool operator==(const Answer&) const = default;
};

struct Case {
  const char* name;
  RegionLevel level;
  std::uint32_t ids_per_region;
  Nanoseconds chunk;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

class LongLists : public RandomQueries, public testing::WithParamInterface<Case> {};

/// Some lists overflow, some are empty.
TEST_P(LongLists, OfALargeBatchEqualThoseOfSmallBatches) {
  open({.chunk = GetParam().chunk});
  fill({31, 600, 12.0});
  RegionQueryOptions options{.name = "many",
                             .capacity = large_batch,
                             .level = GetParam().level,
                             .ids_per_region = GetParam().ids_per_region};
  const auto large = prepare(options);
  options.capacity = 7;
  const auto small = prepare(options);
  for (const double window_s : {0.0, 0.3}) {
    for (Region& region : large->regions()) {
      region = random_region(random(), oracle_world().entities(), scene(), scene().version_time, window_s);
      region.half_extent_m *= 2.0f;
    }
    run(*large, large_batch);
    const auto answers = large->answers();
    ASSERT_EQ(answers.size(), large_batch);
    std::size_t listed = 0;
    std::size_t overflowed = 0;
    for (std::uint32_t first = 0; first < large_batch; first += 7 * 5) {
      const std::uint32_t count = std::min(7u, large_batch - first);
      std::copy_n(large->regions().begin() + first, count, small->regions().begin());
      run(*small, count);
      for (std::uint32_t i = 0; i < count; ++i)
        ASSERT_EQ(Answer(answers[first + i]), Answer(small->answers()[i])) << first + i;
    }
    for (const RegionAnswer& answer : answers) {
      listed += answer.entities.size() + answer.triangles.size();
      overflowed += answer.overflow ? 1 : 0;
    }
    EXPECT_GT(listed, 3u * 8192u) << "too few for two threads";
    EXPECT_GT(overflowed, large_batch / 100);
    EXPECT_LT(overflowed, large_batch / 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, LongLists,
                         testing::Values(Case{"bounds", RegionLevel::bounds, 64, Nanoseconds(0)},
                                         Case{"bounds_in_chunks", RegionLevel::bounds, 64,
                                              Nanoseconds(1'000'000)},
                                         Case{"surfaces", RegionLevel::surface, 64, Nanoseconds(0)},
                                         Case{"triangles", RegionLevel::triangle, 512, Nanoseconds(0)}),
                         [](const auto& test_case) { return std::string(test_case.param.name); });

class OneInstant : public DatabaseTest, public testing::WithParamInterface<std::uint32_t> {};

/// The instances of the instant follow bodies that turn from version to version, few or many of them.
TEST_P(OneInstant, HasThePosesOfEachVersion) {
  const std::uint32_t entities = GetParam();
  const GeometryId bar = add(make_box({4.0, 0.2, 0.2}));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < entities; ++i)
    rows.push_back(row_of(bar, {10.0 * i, 0.0, 0.0}));
  const auto ids = create(rows);
  // A region around the upper end that each body has while it is upright.
  const auto query = prepare(RegionQueryOptions{.name = "ends", .capacity = entities, .ids_per_region = 4});
  for (std::uint32_t i = 0; i < entities; ++i) {
    query->regions()[i].center_m = {10.0f * static_cast<float>(i), 0.0f, 1.5f};
    query->regions()[i].half_extent_m = glm::vec3(0.3f);
    query->regions()[i].t = at_s(1.0);
  }
  const glm::dquat upright(std::sqrt(0.5), 0.0, std::sqrt(0.5), 0.0);
  std::vector<bool> is_upright(entities, false);
  for (const std::uint32_t changed : {1u, 3u, entities / 6, entities / 2}) {
    execute([&](Transaction& transaction) {
      for (std::uint32_t k = 0; k < changed; ++k) {
        const std::uint32_t i = k * (entities / changed);
        is_upright[i] = !is_upright[i];
        transaction.update_motion(ids[i], {.p_world_m = {10.0 * i, 0.0, 0.0},
                                           .q_world = is_upright[i] ? upright : glm::dquat(1, 0, 0, 0)});
      }
    });
    ASSERT_EQ(run(*query, entities).status, Status::committed);
    for (std::uint32_t i = 0; i < entities; ++i) {
      const RegionAnswer& answer = query->answers()[i];
      ASSERT_EQ(answer.found, is_upright[i] ? 1u : 0u) << i << " after " << changed;
      if (is_upright[i]) {
        ASSERT_EQ(answer.entities[0], ids[i]);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, OneInstant, testing::Values(60u, 3000u));

}  // namespace
}  // namespace rtstdb::test
