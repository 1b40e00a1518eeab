// Random worlds, random regions and overlaps: every answer of the GPU against the oracle's.

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "tests/gpu/random_questions.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  std::size_t questions;
};

std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
}

constexpr Case cases[] = {
    {"one_entity", {11, 1, 0.5}, 10'000},
    {"forty", {12, 40, 4.0}, 10'000},
    {"six_hundred", {13, 600, 12.0}, 4'000},
    {"large_build", {14, 2500, 20.0}, 2'000},
};

class RandomRegions : public RandomQuestions, public testing::WithParamInterface<Case> {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    fill(GetParam().world);
  }
};

TEST_P(RandomRegions, AgreeWithTheOracle) {
  const Tally tally =
      ask(RegionQueryOptions{.name = "regions", .ids_per_region = 4096}, GetParam().questions);
  expect_telling(tally, 0.005);
  EXPECT_EQ(tally.full, 0u);
}

TEST_P(RandomRegions, WithLittleRoomAgreeWithTheOracle) {
  const Tally tally = ask(RegionQueryOptions{.name = "regions", .ids_per_region = 5}, GetParam().questions);
  expect_telling(tally, 0.005);
  EXPECT_EQ(tally.full > 0, GetParam().world.entities > 5);
}

TEST_P(RandomRegions, CountsAreThoseOfTheLists) {
  auto listing =
      database().prepare(RegionQueryOptions{.name = "lists", .capacity = batch, .ids_per_region = 4096});
  auto counting =
      database().prepare(RegionQueryOptions{.name = "counts", .capacity = batch, .ids_per_region = 0});
  ASSERT_TRUE(listing.ok() && counting.ok());
  for (const double window_s : {0.0, 0.7}) {
    for (Region& region : listing.value()->regions())
      region = random_region(random(), everything().entities(), scene(), scene().version_time, window_s);
    std::ranges::copy(listing.value()->regions(), counting.value()->regions().begin());
    const Outcome outcome = execute([&](Transaction& transaction) {
      transaction.add_query(*listing.value(), batch);
      transaction.add_query(*counting.value(), batch);
    });
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    std::uint32_t found = 0;
    for (std::uint32_t i = 0; i < batch; ++i) {
      const RegionAnswer& count = counting.value()->answers()[i];
      EXPECT_EQ(count.found, listing.value()->answers()[i].found) << i;
      EXPECT_TRUE(count.entities.empty() && !count.overflow && !count.incomplete);
      found += count.found;
    }
    EXPECT_GT(found, 0u);
  }
}

TEST_P(RandomRegions, OverlapsAgreeWithTheOracle) {
  if (GetParam().world.entities == 1) {
    auto query =
        database().prepare(OverlapQueryOptions{.name = "overlaps", .capacity = 1, .ids_per_entity = 4096});
    ASSERT_TRUE(query.ok());
    query.value()->overlaps()[0] = {.entity = everything().entities()[0].id, .t = scene().version_time};
    ASSERT_EQ(execute([&](Transaction& transaction) { transaction.add_query(*query.value(), 1); }).status,
              Status::committed);
    EXPECT_EQ(query.value()->answers()[0].found, 0u) << "an entity does not overlap itself";
    return;
  }
  expect_telling(ask(OverlapQueryOptions{.name = "overlaps", .ids_per_entity = 4096}, GetParam().questions),
                 0.005);
}

INSTANTIATE_TEST_SUITE_P(Sizes, RandomRegions, testing::ValuesIn(cases),
                         [](const auto& one) { return std::string(one.param.name); });

class Regions : public DatabaseTest {
 protected:
  std::unique_ptr<RegionQuery> prepare(std::uint32_t ids_per_region, std::uint32_t capacity = 4) {
    auto query = database().prepare(
        RegionQueryOptions{.name = "regions", .capacity = capacity, .ids_per_region = ids_per_region});
    EXPECT_TRUE(query.ok());
    return std::move(query).value();
  }
  std::vector<EntityId> boxes(std::uint32_t count) {
    const GeometryId box = add(make_box({1.0, 1.0, 1.0}));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < count; ++i)
      rows.push_back(row_of(box, {2.0 * i, 0.0, 0.0}));
    return create(rows);
  }
  static Region everywhere() {
    Region region;
    region.half_extent_m = glm::vec3(1e4f);
    return region;
  }
};

TEST_F(Regions, OverflowKeepsTheLowestAndTheTrueCount) {
  for (const std::uint32_t count : {100u, 2500u}) {
    open({});
    const auto ids = boxes(count);
    for (const std::uint32_t room : {1u, 2u, 17u, 64u, 99u}) {
      const auto query = prepare(room);
      query->regions()[0] = everywhere();
      const Outcome outcome = execute([&](Transaction& transaction) { transaction.add_query(*query, 1); });
      EXPECT_EQ(outcome.status, Status::truncated);
      const RegionAnswer& answer = query->answers()[0];
      EXPECT_TRUE(answer.overflow);
      EXPECT_FALSE(answer.incomplete);
      EXPECT_EQ(answer.found, count);
      EXPECT_TRUE(std::ranges::equal(answer.entities, std::span(ids).first(room)));
    }
  }
}

TEST_F(Regions, AFrustumLooksAlongXWithYToTheLeftAndZUp) {
  const auto ids = boxes(1);
  const auto query = prepare(4, 14);
  const auto regions = query->regions();
  // The box reaches from -0.5 to 0.5. Ten metres before the eye the view is 2 m wide and 4 m high to each
  // side.
  const auto seen_from = [](const glm::vec3& eye_m, float near_m, RegionTest test) {
    Region made;
    made.shape = RegionShape::frustum;
    made.test = test;
    made.center_m = eye_m;
    made.half_extent_m = {10.0f, 2.0f, 4.0f};
    made.near_m = near_m;
    return made;
  };
  using enum RegionTest;
  regions[0] = seen_from({-10.5f, 0.0f, 0.0f}, 0.0f, touching);
  regions[1] = seen_from({-10.501f, 0.0f, 0.0f}, 0.0f, touching);
  regions[2] = seen_from({0.501f, 0.0f, 0.0f}, 0.0f, touching);
  regions[3] = seen_from({-5.0f, 0.0f, 0.0f}, 5.5f, touching);
  regions[4] = seen_from({-5.0f, 0.0f, 0.0f}, 5.501f, touching);
  // At the box's far side the view is 1.1 m wide and 2.2 m high to each side.
  regions[5] = seen_from({-5.0f, 1.599f, 0.0f}, 0.0f, touching);
  regions[6] = seen_from({-5.0f, 1.601f, 0.0f}, 0.0f, touching);
  regions[7] = seen_from({-5.0f, 0.0f, -2.699f}, 0.0f, touching);
  regions[8] = seen_from({-5.0f, 0.0f, -2.701f}, 0.0f, touching);
  // At its near side 0.9 m and 1.8 m.
  regions[9] = seen_from({-5.0f, 0.399f, 1.299f}, 4.5f, inside);
  regions[10] = seen_from({-5.0f, 0.401f, 0.0f}, 4.5f, inside);
  regions[11] = seen_from({-5.0f, 0.0f, 1.301f}, 4.5f, inside);
  regions[12] = seen_from({-5.0f, 0.0f, 0.0f}, 4.501f, inside);
  // Along y, when turned by a quarter about z.
  regions[13] = seen_from({0.0f, -10.4f, 0.0f}, 0.0f, touching);
  regions[13].q = {std::sqrt(0.5f), 0.0f, 0.0f, std::sqrt(0.5f)};
  EXPECT_EQ(execute([&](Transaction& transaction) { transaction.add_query(*query, 14); }).status,
            Status::committed);
  const std::uint32_t wanted[] = {1, 0, 0, 1, 0, 1, 0, 1, 0, 1, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 14; ++i)
    EXPECT_EQ(query->answers()[i].found, wanted[i]) << i;
}

TEST_F(Regions, AFrustumIsRefusedThatEndsBeforeItBegins) {
  boxes(1);
  const auto query = prepare(4, 1);
  Region& region = query->regions()[0];
  region.shape = RegionShape::frustum;
  for (const auto& [near_m, far_m] : {std::pair{2.0f, 1.0f}, {-0.1f, 1.0f}, {0.0f, 0.0f}}) {
    region.near_m = near_m;
    region.half_extent_m = {far_m, 1.0f, 1.0f};
    const Outcome outcome = execute([&](Transaction& transaction) { transaction.add_query(*query, 1); });
    EXPECT_EQ(outcome.status, Status::bad_input);
    EXPECT_EQ(outcome.bad_input.reason, BadInputReason::bad_region) << near_m << " to " << far_m;
  }
}

/// Many that overflow beside many that do not, in one batch that spans an instant, and in one that spans a
/// window.
TEST_F(Regions, OverflowOfSomeLeavesOthersAsTheyAre) {
  const auto ids = boxes(300);
  constexpr std::uint32_t room = 16;
  const auto query = prepare(room, 300);
  for (const bool moving : {false, true}) {
    for (std::uint32_t i = 0; i < 300; ++i) {
      Region& region = query->regions()[i];
      region = {};
      region.t = at_s(moving ? 1e-3 * i : 0.0);
      // Reaches the bodies 0 to i and no other.
      region.center_m.x = static_cast<float>(i);
      region.half_extent_m = {static_cast<float>(i) + 1.0f, 1.0f, 1.0f};
    }
    EXPECT_EQ(execute([&](Transaction& transaction) { transaction.add_query(*query, 300); }).status,
              Status::truncated);
    for (std::uint32_t i = 0; i < 300; ++i) {
      const RegionAnswer& answer = query->answers()[i];
      EXPECT_EQ(answer.found, i + 1);
      EXPECT_EQ(answer.overflow, i + 1 > room);
      EXPECT_TRUE(std::ranges::equal(answer.entities, std::span(ids).first(std::min(i + 1, room)))) << i;
    }
  }
}

TEST_F(Regions, ExactlyFullIsNotOverflow) {
  const auto ids = boxes(64);
  const auto query = prepare(64);
  query->regions()[0] = everywhere();
  EXPECT_EQ(execute([&](Transaction& transaction) { transaction.add_query(*query, 1); }).status,
            Status::committed);
  EXPECT_FALSE(query->answers()[0].overflow);
  EXPECT_TRUE(std::ranges::equal(query->answers()[0].entities, ids));
}

TEST_F(Regions, TouchingAndInsideAtTheBorder) {
  const auto ids = boxes(1);
  const auto query = prepare(4, 6);
  const auto regions = query->regions();
  // The box reaches from -0.5 to 0.5.
  const auto region = [](RegionShape shape, RegionTest test, float center_x, float half) {
    Region made;
    made.shape = shape;
    made.test = test;
    made.center_m.x = center_x;
    made.half_extent_m = glm::vec3(half);
    return made;
  };
  regions[0] = region(RegionShape::box, RegionTest::touching, 1.5f, 1.0f);
  regions[1] = region(RegionShape::box, RegionTest::touching, 1.501f, 1.0f);
  regions[2] = region(RegionShape::sphere, RegionTest::touching, 1.5f, 1.0f);
  regions[3] = region(RegionShape::sphere, RegionTest::touching, 1.501f, 1.0f);
  regions[4] = region(RegionShape::box, RegionTest::inside, 0.0f, 0.5f);
  regions[5] = region(RegionShape::box, RegionTest::inside, 0.0f, 0.4999f);
  EXPECT_EQ(execute([&](Transaction& transaction) { transaction.add_query(*query, 6); }).status,
            Status::committed);
  const std::uint32_t wanted[] = {1, 0, 1, 0, 1, 0};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(query->answers()[i].found, wanted[i]) << i;
}

TEST_F(Regions, AnEmptyBatchHasNoAnswers) {
  boxes(3);
  const auto query = prepare(4);
  query->regions()[0] = everywhere();
  execute([&](Transaction& transaction) { transaction.add_query(*query, 1); });
  EXPECT_EQ(query->answers().size(), 1u);
  EXPECT_EQ(execute([&](Transaction& transaction) { transaction.add_query(*query, 0); }).status,
            Status::committed);
  EXPECT_TRUE(query->answers().empty());
}

}  // namespace
}  // namespace rtstdb::test
