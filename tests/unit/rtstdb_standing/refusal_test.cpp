// Bad questions are refused when they are registered, with what was wrong.

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include <rtstdb/limits.hpp>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

template <class Asked>
void expect_refused(const Asked& asked, const std::string& words) {
  const auto question = make_query_spec(asked, "gate");
  ASSERT_FALSE(question) << words;
  EXPECT_EQ(question.error().code, ErrorCode::bad_input);
  EXPECT_NE(question.error().message.find("standing query 'gate'"), std::string::npos);
  EXPECT_NE(question.error().message.find(words), std::string::npos) << question.error().message;
}

TEST(Refusal, OfRegions) {
  StandingRegion good;
  good.region.half_extent_m = {1.0f, 2.0f, 3.0f};
  ASSERT_TRUE(make_query_spec(good, "gate"));
  const auto with = [&](const auto& change) {
    StandingRegion asked = good;
    change(asked);
    return asked;
  };
  expect_refused(with([](auto& asked) { asked.region.center_m.y = NAN; }), "nan");
  expect_refused(with([](auto& asked) { asked.region.center_m.z = 2e5f; }), "200000");
  expect_refused(with([](auto& asked) { asked.region.half_extent_m.x = -0.5f; }), "-0.5, 2, 3");
  expect_refused(with([](auto& asked) { asked.region.half_extent_m.x = INFINITY; }), "inf");
  expect_refused(with([](auto& asked) { asked.region.q = {0.0f, 0.0f, 0.0f, 0.0f}; }), "orientation");
  expect_refused(with([](auto& asked) { asked.region.q = {NAN, 0.0f, 0.0f, 0.0f}; }), "orientation");
  expect_refused(with([](auto& asked) { asked.region.shape = static_cast<RegionShape>(7); }), "7, 0");
  expect_refused(with([](auto& asked) { asked.target = static_cast<StandingTarget>(9); }), "9");
  expect_refused(with([](auto& asked) {
                   asked.region.shape = RegionShape::frustum;
                   asked.region.near_m = 1.5f;
                 }),
                 "1.5, 1");
}

TEST(Refusal, OfRegionsThatHoldNobody) {
  StandingRegion flat;
  flat.region.half_extent_m = {1.0f, 0.0f, 3.0f};
  EXPECT_TRUE(make_query_spec(flat, "gate")) << "bounds can touch a curtain";
  flat.target = StandingTarget::center;
  expect_refused(flat, "empty");
  flat.target = StandingTarget::bounds;
  flat.region.test = RegionTest::inside;
  expect_refused(flat, "1, 0, 3");
  flat.region.shape = RegionShape::sphere;
  flat.region.half_extent_m = {};
  expect_refused(flat, "empty");
  flat.region.shape = RegionShape::frustum;
  flat.region.half_extent_m = {5.0f, 1.0f, 1.0f};
  flat.region.near_m = 5.0f;
  expect_refused(flat, "empty");
}

TEST(Refusal, OfRays) {
  StandingRay asked;
  ASSERT_TRUE(make_query_spec(asked, "gate"));
  asked.ray.direction = {};
  expect_refused(asked, "direction");
  asked.ray.direction = {0.0f, NAN, 1.0f};
  expect_refused(asked, "nan");
  asked.ray = {};
  asked.ray.lambda_min = 3.0f;
  asked.ray.lambda_max = 2.0f;
  expect_refused(asked, "3, 2");
  asked.ray.lambda_min = -1.0f;
  expect_refused(asked, "-1, 2");
  asked.ray = {};
  asked.ray.origin_m.x = -INFINITY;
  expect_refused(asked, "-inf");
}

TEST(Refusal, OfNearest) {
  StandingNearest asked;
  ASSERT_TRUE(make_query_spec(asked, "gate"));
  asked.k = 0;
  expect_refused(asked, "0, 32");
  asked.k = max_neighbors + 1;
  expect_refused(asked, "33, 32");
  asked.k = 1;
  asked.point.radius_m = -1.0f;
  expect_refused(asked, "-1");
  asked.point.radius_m = NAN;
  expect_refused(asked, "nan");
  asked.point.radius_m = 0.0f;
  EXPECT_TRUE(make_query_spec(asked, "gate")) << "bounds can hold the point";
  asked.target = StandingTarget::center;
  expect_refused(asked, "zero");
}

TEST(Refusal, OfTheDeadAndOfRings) {
  FollowedWorld world;
  const EntityId alive = world.create(EntityRow{}, 0);
  const EntityId dead = world.create(EntityRow{}, 0);
  world.remove(dead, 0);
  StandingRegion asked;
  asked.region.half_extent_m = {1.0f, 1.0f, 1.0f};
  const auto refused = [&](const StandingRegion& wanted, const StandingOptions& options) {
    auto made = world.follower().watch(make_query_spec(wanted, options.name).value(), options);
    EXPECT_FALSE(made);
    return made ? std::string() : made.error().message;
  };
  asked.region.carrier = dead;
  EXPECT_EQ(refused(asked, {.name = "gate"}), "standing query 'gate': its carrier 2.1 does not exist");
  asked.region.carrier = alive;
  asked.excluded = {dead.index, 7};
  EXPECT_EQ(refused(asked, {.name = "gate"}), "standing query 'gate': the excluded entity 2.7 does not exist");
  asked.excluded = {};
  EXPECT_NE(refused(asked, {.name = "gate", .ring_capacity = 1}).find("ring_capacity is 1"),
            std::string::npos);
  EXPECT_NE(refused(asked, {.name = "gate", .ring_capacity = max_standing_events + 1}).find("4194305"),
            std::string::npos);
  EXPECT_EQ(world.follower().counts().queries, 0u);
  const auto query = world.watch(asked);
  EXPECT_EQ(world.follower().counts().queries, 1u);
}

}  // namespace
}  // namespace rtstdb::standing::test
