// Random regions and overlaps in random worlds: each answer is compared with the oracle.

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  std::size_t regions;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

constexpr Case cases[] = {
    {"one_entity", {11, 1, 0.5}, 10'000},
    {"forty", {12, 40, 4.0}, 10'000},
    {"six_hundred", {13, 600, 12.0}, 4'000},
    {"large_build", {14, 2500, 20.0}, 2'000},
};

class RandomRegions : public RandomQueries, public testing::WithParamInterface<Case> {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    fill(GetParam().world);
  }
};

TEST_P(RandomRegions, AgreeWithTheOracle) {
  for (const std::uint32_t ids_per_region : {4096u, 5u, 0u}) {
    SCOPED_TRACE(testing::Message() << ids_per_region << " ids per region");
    const Tally tally = run_random(RegionQueryOptions{.name = "regions", .ids_per_region = ids_per_region},
                                   GetParam().regions);
    expect_informative(tally, 0.005);
    EXPECT_EQ(tally.full > 0, ids_per_region == 5 && GetParam().world.entities > 5);
  }
}

TEST_P(RandomRegions, OverlapsAgreeWithTheOracle) {
  if (GetParam().world.entities == 1) {
    const auto query =
        prepare(OverlapQueryOptions{.name = "overlaps", .capacity = 1, .ids_per_entity = 4096});
    query->overlaps()[0] = {.entity = oracle_world().entities()[0].id, .t = scene().version_time};
    ASSERT_EQ(run(*query, 1).status, Status::committed);
    EXPECT_EQ(query->answers()[0].found, 0u) << "an entity does not overlap itself";
    return;
  }
  expect_informative(
      run_random(OverlapQueryOptions{.name = "overlaps", .ids_per_entity = 4096}, GetParam().regions), 0.005);
}

INSTANTIATE_TEST_SUITE_P(Sizes, RandomRegions, testing::ValuesIn(cases),
                         [](const auto& test_case) { return std::string(test_case.param.name); });

}  // namespace
}  // namespace rtstdb::test
