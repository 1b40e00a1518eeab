// Rays of RayMode::first: several hits, in order.

#include <algorithm>
#include <optional>

#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

class FirstHits : public DatabaseTest {
 protected:
  std::vector<RayHit> hits_of(std::span<const Ray> rays, std::uint32_t hits_per_ray) {
    const auto query = prepare(RayQueryOptions{.name = "first",
                                               .capacity = static_cast<std::uint32_t>(rays.size()),
                                               .mode = RayMode::first,
                                               .hits_per_ray = hits_per_ray});
    std::ranges::copy(rays, query->rays().begin());
    const Outcome outcome = run(*query, rays.size());
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    return {query->hits().begin(), query->hits().end()};
  }
};

TEST_F(FirstHits, OfEqualLambdaAreOrderedByEntityAndTriangle) {
  const GeometryId three = add(repeated_triangle(3));
  const EntityId first = create(row_of(three, {0.0, 0.0, 5.0}));
  const EntityId second = create(row_of(three, {0.0, 0.0, 5.0}));
  const Ray up = ray_from({}, {0, 0, 1});
  const auto hits = hits_of(std::span(&up, 1), 4);
  const EntityId entities[] = {first, first, first, second};
  const std::uint32_t triangles[] = {0, 1, 2, 0};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(hits[k].entity, entities[k]);
    EXPECT_EQ(hits[k].triangle, triangles[k]);
    EXPECT_EQ(hits[k].lambda, 5.0f);
  }
}

/// The search takes more rounds than a dispatch has.
TEST_F(FirstHits, OfAPileAreTheLowest) {
  const EntityId dense = create(row_of(add(repeated_triangle(100'000)), {0.0, 0.0, 5.0}));
  const Ray rays[] = {ray_from({}, {0, 0, 1}), ray_from({}, {0, 0, -1})};
  for (const std::uint32_t hits_per_ray : {3u, 16u}) {
    const auto hits = hits_of(rays, hits_per_ray);
    for (std::uint32_t k = 0; k < hits_per_ray; ++k) {
      EXPECT_EQ(hits[k].status, HitStatus::hit);
      EXPECT_EQ(hits[k].entity, dense);
      EXPECT_EQ(hits[k].triangle, k);
      EXPECT_EQ(hits[k].lambda, 5.0f);
      EXPECT_EQ(hits[hits_per_ray + k].status, HitStatus::miss);
    }
  }
}

TEST_F(FirstHits, HaveALimitPerRayAndPerQuery) {
  const auto refused = [&](RayMode mode, std::uint32_t hits_per_ray, std::uint32_t capacity) {
    const auto query = database().prepare(
        RayQueryOptions{.name = "many", .capacity = capacity, .mode = mode, .hits_per_ray = hits_per_ray});
    return query.ok() ? std::nullopt : std::optional(query.error().code);
  };
  EXPECT_EQ(refused(RayMode::first, 0, 1), ErrorCode::capacity);
  EXPECT_EQ(refused(RayMode::first, max_hits_per_ray + 1, 1), ErrorCode::capacity);
  EXPECT_EQ(refused(RayMode::first, max_hits_per_ray, max_hits_per_query / max_hits_per_ray + 1),
            ErrorCode::capacity);
  EXPECT_EQ(refused(RayMode::first, max_hits_per_ray, 4), std::nullopt);
  for (const RayMode mode : {RayMode::closest, RayMode::any}) {
    for (const std::uint32_t hits_per_ray : {0u, 2u, max_hits_per_ray + 1})
      EXPECT_EQ(refused(mode, hits_per_ray, 1), ErrorCode::bad_input);
    EXPECT_EQ(refused(mode, 1, 1), std::nullopt);
  }
}

class RandomFirstHits : public RandomQueries {
 protected:
  void expect_agreement_with_the_oracle() {
    fill({.seed = 12, .entities = 120, .radius_m = 6.0});
    Tally tally;
    for (const std::uint32_t hits_per_ray : {1u, 3u, 4u, 9u, 16u}) {
      for (const bool ignore_motion : {false, true}) {
        tally += run_random(RayQueryOptions{.name = "first",
                                            .mode = RayMode::first,
                                            .hits_per_ray = hits_per_ray,
                                            .ignore_motion = ignore_motion},
                            500);
      }
    }
    tally += run_random(
        RayQueryOptions{.name = "first", .mode = RayMode::first, .hits_per_ray = 3, .faces = Faces::back},
        500);
    expect_informative(tally, 0.02);
    EXPECT_GT(tally.full, tally.elements / 20);
  }
};

TEST_F(RandomFirstHits, AgreeWithTheOracle) {
  expect_agreement_with_the_oracle();
}

TEST_F(RandomFirstHits, AgreeWithTheOracleWithoutSubgroupKernels) {
  open({}, {.use_subgroup_kernels = false});
  expect_agreement_with_the_oracle();
}

}  // namespace
}  // namespace rtstdb::test
