// The first hits of a ray, in order.

#include <algorithm>

#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

class FirstHits : public DatabaseTest {
 protected:
  std::unique_ptr<RayQuery> prepare_first(std::uint32_t hits_per_ray, std::uint32_t capacity,
                                          bool ignore_motion = false) {
    auto query = database().prepare(RayQueryOptions{.name = "first",
                                                    .capacity = capacity,
                                                    .mode = RayMode::first,
                                                    .hits_per_ray = hits_per_ray,
                                                    .ignore_motion = ignore_motion});
    EXPECT_TRUE(query.ok());
    return std::move(query).value();
  }
  std::vector<RayHit> ask(RayQuery& query, std::span<const Ray> rays) {
    std::ranges::copy(rays, query.rays().begin());
    const Outcome outcome = execute([&](Transaction& transaction) {
      transaction.add_query(query, static_cast<std::uint32_t>(rays.size()));
    });
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    return {query.hits().begin(), query.hits().end()};
  }
};

TEST_F(FirstHits, OfBoxesInARowComeInOrder) {
  const GeometryId box = add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityId> ids;
  for (const double x_m : {6.0, 2.0, 4.0})
    ids.push_back(create(row_of(box, {x_m, 0.0, 0.0})));
  const Ray along = ray_from({0.0f, 0.2f, 0.1f}, {1, 0, 0});
  const auto seven = ask(*prepare_first(7, 1), std::span(&along, 1));
  ASSERT_EQ(seven.size(), 7u);
  const float lambdas[] = {1.5f, 2.5f, 3.5f, 4.5f, 5.5f, 6.5f};
  const std::uint32_t whose[] = {1, 1, 2, 2, 0, 0};
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(seven[k].status, HitStatus::hit);
    EXPECT_EQ(seven[k].lambda, lambdas[k]);
    EXPECT_EQ(seven[k].entity, ids[whose[k]]);
    EXPECT_EQ(seven[k].front_face, k % 2 == 0);
    EXPECT_EQ(seven[k].n_world, glm::vec3(k % 2 == 0 ? -1.0f : 1.0f, 0.0f, 0.0f));
  }
  EXPECT_EQ(seven[6].status, HitStatus::miss);
  EXPECT_FALSE(seven[6].entity.valid());
  const auto two = ask(*prepare_first(2, 1), std::span(&along, 1));
  EXPECT_EQ(two[0].lambda, 1.5f);
  EXPECT_EQ(two[1].lambda, 2.5f);
}

TEST_F(FirstHits, AtOneLambdaComeByEntityAndTriangle) {
  const GeometryId pile = add({{{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}}, std::vector<glm::uvec3>(3, {0, 1, 2})});
  const EntityId first = create(row_of(pile, {0.0, 0.0, 5.0}));
  const EntityId second = create(row_of(pile, {0.0, 0.0, 5.0}));
  const Ray up = ray_from({}, {0, 0, 1});
  const auto hits = ask(*prepare_first(4, 1), std::span(&up, 1));
  const EntityId whose[] = {first, first, first, second};
  const std::uint32_t triangles[] = {0, 1, 2, 0};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(hits[k].entity, whose[k]);
    EXPECT_EQ(hits[k].triangle, triangles[k]);
    EXPECT_EQ(hits[k].lambda, 5.0f);
  }
}

/// It takes more rounds than a dispatch has.
TEST_F(FirstHits, OfAPileAreTheLowest) {
  const EntityId heap =
      create(row_of(add({{{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}}, std::vector<glm::uvec3>(100'000, {0, 1, 2})}),
                    {0.0, 0.0, 5.0}));
  const Ray rays[] = {ray_from({}, {0, 0, 1}), ray_from({}, {0, 0, -1})};
  for (const std::uint32_t hits_per_ray : {3u, 16u}) {
    const auto hits = ask(*prepare_first(hits_per_ray, 2), rays);
    for (std::uint32_t k = 0; k < hits_per_ray; ++k) {
      EXPECT_EQ(hits[k].status, HitStatus::hit);
      EXPECT_EQ(hits[k].entity, heap);
      EXPECT_EQ(hits[k].triangle, k);
      EXPECT_EQ(hits[k].lambda, 5.0f);
      EXPECT_EQ(hits[hits_per_ray + k].status, HitStatus::miss);
    }
  }
}

TEST_F(FirstHits, AsManyAsMakeSenseMayBeAsked) {
  const auto refused = [&](RayMode mode, std::uint32_t hits_per_ray, std::uint32_t capacity) {
    auto query = database().prepare(
        RayQueryOptions{.name = "much", .capacity = capacity, .mode = mode, .hits_per_ray = hits_per_ray});
    return !query.ok() && query.error().code == ErrorCode::capacity;
  };
  EXPECT_TRUE(refused(RayMode::first, 0, 1));
  EXPECT_TRUE(refused(RayMode::first, max_hits_per_ray + 1, 1));
  EXPECT_TRUE(refused(RayMode::closest, 2, 1));
  EXPECT_TRUE(refused(RayMode::any, 2, 1));
  EXPECT_TRUE(refused(RayMode::first, max_hits_per_ray, max_hits_per_query / max_hits_per_ray + 1));
  EXPECT_FALSE(refused(RayMode::first, max_hits_per_ray, 4));
}

class RandomFirstHits : public RandomQueries {
 protected:
  void expect_those_of_the_oracle() {
    fill({.seed = 12, .entities = 120, .radius_m = 6.0});
    Tally tally;
    for (const std::uint32_t hits_per_ray : {1u, 3u, 4u, 9u, 16u}) {
      for (const bool ignore_motion : {false, true}) {
        const RayQueryOptions wanted{.name = "first",
                                     .mode = RayMode::first,
                                     .hits_per_ray = hits_per_ray,
                                     .ignore_motion = ignore_motion};
        tally += ask(wanted, 500);
      }
    }
    tally +=
        ask(RayQueryOptions{.name = "first", .mode = RayMode::first, .hits_per_ray = 3, .faces = Faces::back},
            500);
    expect_informative(tally, 0.02);
    EXPECT_GT(tally.full, tally.elements / 20);
  }
};

TEST_F(RandomFirstHits, AgreeWithTheOracle) {
  expect_those_of_the_oracle();
}

/// As on a device whose lanes do not work together.
TEST_F(RandomFirstHits, OfLoneLanesAgreeWithTheOracle) {
  open({}, {.use_subgroup_kernels = false});
  expect_those_of_the_oracle();
}

}  // namespace
}  // namespace rtstdb::test
