// Random rays in random worlds: each answer is compared with the oracle.

#include <algorithm>
#include <numeric>
#include <ostream>
#include <string>

#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  std::size_t rays;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

/// One workgroup builds a tree of up to 2048 entities; several passes build a larger one.
constexpr Case cases[] = {
    {"one_entity", {10, 1, 0.3}, 60'000},
    {"two", {6, 2, 0.5}, 60'000},
    {"nine", {3, 9, 2.0}, 70'000},
    {"sixty", {4, 60, 5.0}, 60'000},
    {"four_hundred", {5, 400, 14.0}, 24'000},
    {"last_small_build", {6, 2048, 30.0}, 8'000},
    {"first_large_build", {7, 2049, 30.0}, 8'000},
    {"three_thousand", {8, 3000, 36.0}, 8'000},
};

class RandomRays : public RandomQueries, public testing::WithParamInterface<Case> {
 protected:
  /// Rays of each kind that has its own kernel.
  Tally run_all_kinds(std::size_t rays) {
    const auto part = [&](double fraction) {
      return static_cast<std::size_t>(fraction * static_cast<double>(rays));
    };
    Tally tally = run_random(RayQueryOptions{.name = "rays"}, part(0.6));
    tally += run_random(RayQueryOptions{.name = "rays", .mode = RayMode::any}, part(0.25));
    tally += run_random(RayQueryOptions{.name = "rays", .ignore_motion = true}, part(0.1));
    tally +=
        run_random(RayQueryOptions{.name = "rays", .mode = RayMode::any, .ignore_motion = true}, part(0.05));
    return tally;
  }
};

TEST_P(RandomRays, AgreeWithTheOracle) {
  fill(GetParam().world);
  expect_informative(run_all_kinds(GetParam().rays), 0.005);
}

TEST_P(RandomRays, AgreeWithTheOracleWithoutSubgroupKernels) {
  open({}, {.use_subgroup_kernels = false});
  fill(GetParam().world);
  expect_informative(run_all_kinds(GetParam().rays / 4), 0.005);
}

TEST_P(RandomRays, AgreeWithTheOracleOnOneSideOfTriangles) {
  fill(GetParam().world);
  Tally tally = run_random(RayQueryOptions{.name = "rays", .faces = Faces::front}, GetParam().rays / 20);
  tally += run_random(RayQueryOptions{.name = "rays", .faces = Faces::back}, GetParam().rays / 20);
  expect_informative(tally, 0.005);
}

TEST_P(RandomRays, AgreeWithTheOracleInPackets) {
  fill(GetParam().world);
  const std::size_t tenth = GetParam().rays / 10;
  Tally tally = run_neighbours(RayQueryOptions{.name = "rays"}, 4 * tenth);
  tally += run_neighbours(RayQueryOptions{.name = "rays", .mode = RayMode::any}, 2 * tenth);
  tally += run_neighbours(RayQueryOptions{.name = "rays", .ignore_motion = true}, 2 * tenth);
  tally +=
      run_neighbours(RayQueryOptions{.name = "rays", .mode = RayMode::any, .ignore_motion = true}, tenth);
  tally += run_neighbours(RayQueryOptions{.name = "rays", .faces = Faces::back}, tenth);
  expect_informative(tally, 0.005);
}

INSTANTIATE_TEST_SUITE_P(Sizes, RandomRays, testing::ValuesIn(cases),
                         [](const auto& test_case) { return std::string(test_case.param.name); });

}  // namespace
}  // namespace rtstdb::test
