// Bad standing queries are refused at registration, with the wrong values.

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include <rtstdb/limits.hpp>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

template <class Definition>
void expect_refused(const Definition& definition, const std::string& part) {
  const auto spec = make_query_spec(definition, "gate");
  ASSERT_FALSE(spec) << part;
  EXPECT_EQ(spec.error().code, ErrorCode::bad_input);
  EXPECT_NE(spec.error().message.find("standing query 'gate'"), std::string::npos);
  EXPECT_NE(spec.error().message.find(part), std::string::npos) << spec.error().message;
}

TEST(Refusal, OfRegions) {
  StandingRegion good;
  good.region.half_extent_m = {1.0f, 2.0f, 3.0f};
  ASSERT_TRUE(make_query_spec(good, "gate"));
  const auto with = [&](const auto& change) {
    StandingRegion definition = good;
    change(definition);
    return definition;
  };
  expect_refused(with([](auto& definition) { definition.region.center_m.y = NAN; }), "nan");
  expect_refused(with([](auto& definition) { definition.region.center_m.z = 2e5f; }), "200000");
  expect_refused(with([](auto& definition) { definition.region.half_extent_m.x = -0.5f; }), "-0.5, 2, 3");
  expect_refused(with([](auto& definition) { definition.region.half_extent_m.x = INFINITY; }), "inf");
  expect_refused(with([](auto& definition) {
                   definition.region.q = {0.0f, 0.0f, 0.0f, 0.0f};
                 }),
                 "orientation");
  expect_refused(with([](auto& definition) {
                   definition.region.q = {NAN, 0.0f, 0.0f, 0.0f};
                 }),
                 "orientation");
  expect_refused(with([](auto& definition) { definition.region.shape = static_cast<RegionShape>(7); }),
                 "7, 0");
  expect_refused(with([](auto& definition) { definition.target = static_cast<StandingTarget>(9); }), "9");
  expect_refused(with([](auto& definition) {
                   definition.region.shape = RegionShape::frustum;
                   definition.region.near_m = 1.5f;
                 }),
                 "1.5, 1");
}

TEST(Refusal, OfEmptyRegions) {
  StandingRegion flat;
  flat.region.half_extent_m = {1.0f, 0.0f, 3.0f};
  EXPECT_TRUE(make_query_spec(flat, "gate")) << "bounds can touch a flat region";
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
  StandingRay definition;
  ASSERT_TRUE(make_query_spec(definition, "gate"));
  definition.ray.direction = {};
  expect_refused(definition, "direction");
  definition.ray.direction = {0.0f, NAN, 1.0f};
  expect_refused(definition, "nan");
  definition.ray = {};
  definition.ray.lambda_min = 3.0f;
  definition.ray.lambda_max = 2.0f;
  expect_refused(definition, "3, 2");
  definition.ray.lambda_min = -1.0f;
  expect_refused(definition, "-1, 2");
  definition.ray = {};
  definition.ray.origin_m.x = -INFINITY;
  expect_refused(definition, "-inf");
}

TEST(Refusal, OfNearest) {
  StandingNearest definition;
  ASSERT_TRUE(make_query_spec(definition, "gate"));
  definition.k = 0;
  expect_refused(definition, "0, 32");
  definition.k = max_neighbors + 1;
  expect_refused(definition, "33, 32");
  definition.k = 1;
  definition.point.radius_m = -1.0f;
  expect_refused(definition, "-1");
  definition.point.radius_m = NAN;
  expect_refused(definition, "nan");
  definition.point.radius_m = 0.0f;
  EXPECT_TRUE(make_query_spec(definition, "gate")) << "bounds can hold the point";
  definition.target = StandingTarget::center;
  expect_refused(definition, "zero");
}

TEST(Refusal, OfUnknownEntitiesAndRings) {
  FollowedWorld world;
  const EntityId alive = world.create(EntityRow{}, 0);
  const EntityId removed = world.create(EntityRow{}, 0);
  world.remove(removed, 0);
  StandingRegion definition;
  definition.region.half_extent_m = {1.0f, 1.0f, 1.0f};
  const auto refused = [&](const StandingRegion& region, const StandingOptions& options) {
    auto made = world.follower().watch(make_query_spec(region, options.name).value(), options);
    EXPECT_FALSE(made);
    return made ? std::string() : made.error().message;
  };
  definition.region.carrier = removed;
  EXPECT_EQ(refused(definition, {.name = "gate"}), "standing query 'gate': its carrier 2.1 does not exist");
  definition.region.carrier = alive;
  definition.excluded = {removed.index, 7};
  EXPECT_EQ(refused(definition, {.name = "gate"}),
            "standing query 'gate': the excluded entity 2.7 does not exist");
  definition.excluded = {};
  EXPECT_NE(refused(definition, {.name = "gate", .ring_capacity = 1}).find("ring_capacity is 1"),
            std::string::npos);
  EXPECT_NE(refused(definition, {.name = "gate", .ring_capacity = max_standing_events + 1}).find("4194305"),
            std::string::npos);
  EXPECT_EQ(world.follower().counts().queries, 0u);
  const auto query = world.watch(definition);
  EXPECT_EQ(world.follower().counts().queries, 1u);
}

}  // namespace
}  // namespace rtstdb::standing::test
