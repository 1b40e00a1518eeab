// Batches of many long answers, which two threads put in order, and of versions that follow one another at
// one instant.

#include <algorithm>

#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t large_batch = 3000;

struct Listed {
  std::vector<EntityId> entities;
  std::vector<EntityTriangle> triangles;
  std::uint32_t found = 0;
  bool overflow = false, incomplete = false;
  explicit Listed(const RegionAnswer& answer)
      : entities(answer.entities.begin(), answer.entities.end()),
        triangles(answer.triangles.begin(), answer.triangles.end()),
        found(answer.found),
        overflow(answer.overflow),
        incomplete(answer.incomplete) {}
  bool operator==(const Listed&) const = default;
};

struct Case {
  const char* name;
  RegionLevel level;
  std::uint32_t ids_per_region;
  Nanoseconds chunk;
};

std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
}

class LongAnswers : public RandomQueries, public testing::WithParamInterface<Case> {};

/// Some overflow, some are empty.
TEST_P(LongAnswers, OfALargeBatchAreThoseOfSmallOnes) {
  open({.chunk = GetParam().chunk});
  fill({31, 600, 12.0});
  RegionQueryOptions options{.name = "many",
                             .capacity = large_batch,
                             .level = GetParam().level,
                             .ids_per_region = GetParam().ids_per_region};
  auto large = database().prepare(options);
  options.capacity = 7;
  auto small = database().prepare(options);
  ASSERT_TRUE(large.ok() && small.ok());
  for (const double window_s : {0.0, 0.3}) {
    for (Region& region : large.value()->regions()) {
      region = random_region(random(), everything().entities(), scene(), scene().version_time, window_s);
      region.half_extent_m *= 2.0f;
    }
    execute([&](Transaction& transaction) { transaction.add_query(*large.value(), large_batch); });
    const auto answers = large.value()->answers();
    ASSERT_EQ(answers.size(), large_batch);
    std::size_t listed = 0;
    std::size_t overflowed = 0;
    for (std::uint32_t first = 0; first < large_batch; first += 7 * 5) {
      const std::uint32_t count = std::min(7u, large_batch - first);
      std::copy_n(large.value()->regions().begin() + first, count, small.value()->regions().begin());
      execute([&](Transaction& transaction) { transaction.add_query(*small.value(), count); });
      for (std::uint32_t i = 0; i < count; ++i)
        ASSERT_EQ(Listed(answers[first + i]), Listed(small.value()->answers()[i])) << first + i;
    }
    for (const RegionAnswer& answer : answers) {
      listed += answer.entities.size() + answer.triangles.size();
      overflowed += answer.overflow ? 1 : 0;
    }
    EXPECT_GT(listed, 3u * 8192u) << "shared by no threads";
    EXPECT_GT(overflowed, large_batch / 100);
    EXPECT_LT(overflowed, large_batch / 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, LongAnswers,
                         testing::Values(Case{"bounds", RegionLevel::bounds, 64, Nanoseconds(0)},
                                         Case{"bounds_in_chunks", RegionLevel::bounds, 64,
                                              Nanoseconds(1'000'000)},
                                         Case{"surfaces", RegionLevel::surface, 64, Nanoseconds(0)},
                                         Case{"triangles", RegionLevel::triangle, 512, Nanoseconds(0)}),
                         [](const auto& one) { return std::string(one.param.name); });

class OneInstant : public DatabaseTest, public testing::WithParamInterface<std::uint32_t> {};

/// Bodies that are turned from version to version, few or many, while all questions are about one instant:
/// what is written down of bodies for it follows them.
TEST_P(OneInstant, FollowsTheVersions) {
  const std::uint32_t entities = GetParam();
  const GeometryId bar = add(make_box({4.0, 0.2, 0.2}));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < entities; ++i)
    rows.push_back(row_of(bar, {10.0 * i, 0.0, 0.0}));
  const auto ids = create(rows);
  // One region about each body's upper end once it stands upright.
  auto query =
      database().prepare(RegionQueryOptions{.name = "ends", .capacity = entities, .ids_per_region = 4});
  ASSERT_TRUE(query.ok());
  for (std::uint32_t i = 0; i < entities; ++i) {
    query.value()->regions()[i].center_m = {10.0f * static_cast<float>(i), 0.0f, 1.5f};
    query.value()->regions()[i].half_extent_m = glm::vec3(0.3f);
    query.value()->regions()[i].t = at_s(1.0);
  }
  const glm::dquat upright(std::sqrt(0.5), 0.0, std::sqrt(0.5), 0.0);
  std::vector<bool> stands(entities, false);
  for (const std::uint32_t changed : {1u, 3u, entities / 6, entities / 2}) {
    execute([&](Transaction& transaction) {
      for (std::uint32_t k = 0; k < changed; ++k) {
        const std::uint32_t i = k * (entities / changed);
        stands[i] = !stands[i];
        transaction.update_motion(ids[i], {.p_world_m = {10.0 * i, 0.0, 0.0},
                                           .q_world = stands[i] ? upright : glm::dquat(1, 0, 0, 0)});
      }
    });
    ASSERT_EQ(
        execute([&](Transaction& transaction) { transaction.add_query(*query.value(), entities); }).status,
        Status::committed);
    for (std::uint32_t i = 0; i < entities; ++i) {
      const RegionAnswer& answer = query.value()->answers()[i];
      ASSERT_EQ(answer.found, stands[i] ? 1u : 0u) << i << " after " << changed;
      if (stands[i]) {
        ASSERT_EQ(answer.entities[0], ids[i]);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, OneInstant, testing::Values(60u, 3000u));

}  // namespace
}  // namespace rtstdb::test
