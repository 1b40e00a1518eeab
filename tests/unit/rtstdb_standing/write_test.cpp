// The immediate effects of writes on members: entities and carriers are created, jump, are removed, and
// replaced; shapes change.

#include <gtest/gtest.h>

#include <vector>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

using enum EventKind;

class Writes : public testing::Test {
 protected:
  Writes() {
    cube = world.add(make_box({1.0, 1.0, 1.0}));
    definition.region.half_extent_m = {5.0f, 5.0f, 5.0f};
  }

  struct Effect {
    EventKind kind;
    EntityId entity;
    friend bool operator==(const Effect&, const Effect&) = default;
  };
  /// The events with EventCause::write, all at this time.
  std::vector<Effect> events(StandingQuery& query, std::int64_t ns) {
    std::vector<Effect> all;
    for (const StandingEvent& event : events_of(world, query)) {
      if (event.cause == EventCause::list) continue;
      EXPECT_EQ(event.cause, EventCause::write);
      EXPECT_EQ(event.time, at_ns(ns));
      EXPECT_EQ(event.version, world.engine().latest().version);
      all.push_back({event.kind, event.entity});
    }
    return all;
  }

  FollowedWorld world;
  GeometryId cube;
  StandingRegion definition;
};

TEST_F(Writes, OfEachKindChangeMembership) {
  const auto query = world.watch(definition);
  EXPECT_TRUE(events(*query, 0).empty());
  const EntityId one = world.create(row_of(cube), 10);
  EXPECT_EQ(events(*query, 10), (std::vector<Effect>{{enter, one}}));
  world.update(one, row_of(cube, {20.0, 0.0, 0.0}), 20);
  EXPECT_EQ(events(*query, 20), (std::vector<Effect>{{exit, one}}));
  world.update(one, row_of(cube, {5.5, 0.0, 0.0}), 20);  // touches
  EXPECT_EQ(events(*query, 20), (std::vector<Effect>{{enter, one}}));
  EntityRow unseen = row_of(cube);
  unseen.mask = 0;
  world.update(one, unseen, 30);
  EXPECT_EQ(events(*query, 30), (std::vector<Effect>{{exit, one}}));
  world.update(one, row_of(GeometryId{}), 31);
  EXPECT_TRUE(events(*query, 31).empty());
  world.update(one, row_of(cube), 32);
  EXPECT_EQ(events(*query, 32), (std::vector<Effect>{{enter, one}}));
  world.remove(one, 40);
  EXPECT_EQ(events(*query, 40), (std::vector<Effect>{{exit, one}}));
}

TEST_F(Writes, ThatReuseAnIndexAreOfAnotherEntity) {
  const EntityId one = world.create(row_of(cube), 0);
  const auto region = world.watch(definition);
  const auto nearest = world.watch(StandingNearest{});
  static_cast<void>(events(*region, 0));
  static_cast<void>(events(*nearest, 0));
  std::uint32_t ordinal = 0;
  world.execute(
      [&](Transaction& transaction) {
        transaction.remove(one);
        ordinal = transaction.create(row_of(cube, {1.0, 0.0, 0.0}));
      },
      10);
  const EntityId other = world.created(ordinal);
  ASSERT_EQ(other.index, one.index);
  EXPECT_EQ(events(*region, 10), (std::vector<Effect>{{exit, one}, {enter, other}}));
  EXPECT_EQ(events(*nearest, 10), (std::vector<Effect>{{exit, one}, {enter, other}}));
}

TEST_F(Writes, ToACarrierMoveTheQuery) {
  const EntityId carrier = world.create(EntityRow{}, 0);
  const EntityId near = world.create(row_of(cube), 0);
  const EntityId far = world.create(row_of(cube, {100.0, 0.0, 0.0}), 0);
  definition.region.carrier = carrier;
  const auto region = world.watch(definition);
  StandingNearest point;
  point.point.carrier = carrier;
  const auto nearest = world.watch(point);
  StandingRay beam;
  beam.ray.origin_m = {0.0f, -4.0f, 0.0f};
  beam.ray.direction = {0.0f, 1.0f, 0.0f};
  beam.ray.carrier = carrier;
  const auto ray = world.watch(beam);
  for (StandingQuery* query : {region.get(), nearest.get(), ray.get()})
    static_cast<void>(events(*query, 0));
  EntityRow jumped;
  jumped.motion.p_world_m = {100.0, 0.0, 0.0};
  world.update(carrier, jumped, 10);
  for (StandingQuery* query : {region.get(), nearest.get(), ray.get()})
    EXPECT_EQ(events(*query, 10), (std::vector<Effect>{{exit, near}, {enter, far}}));
}

TEST_F(Writes, ThatRemoveTheCarrierEndTheQuery) {
  const EntityId carrier = world.create(EntityRow{}, 0);
  const EntityId one = world.create(row_of(cube), 0);
  definition.region.carrier = carrier;
  const auto query = world.watch(definition, {.name = "bumper"});
  static_cast<void>(events(*query, 0));
  EXPECT_EQ(query->status(), StandingStatus::following);
  EXPECT_EQ(query->reason(), "");
  world.remove(carrier, 10);
  EXPECT_EQ(events(*query, 10), (std::vector<Effect>{{exit, one}}));
  EXPECT_TRUE(
      hil::tests::eventually([&] { return query->status() != StandingStatus::following; }, event_limit));
  EXPECT_EQ(query->status(), StandingStatus::ended);
  EXPECT_EQ(query->reason(), "standing query 'bumper': its carrier was removed");
  // An entity with the same index is not the carrier.
  world.create(EntityRow{}, 20);
  world.create(row_of(cube), 30);
  EXPECT_TRUE(events(*query, 30).empty());
}

TEST_F(Writes, DoNotMakeTheExcludedEntityAMember) {
  const EntityId self = world.create(row_of(cube), 0);
  const EntityId other = world.create(row_of(cube, {2.0, 0.0, 0.0}), 0);
  definition.excluded = self;
  definition.region.carrier = self;
  const auto query = world.watch(definition);
  Members members;
  members.take(events_of(world, *query));
  EXPECT_EQ(members.all(), std::vector{other});
}

TEST_F(Writes, ToShapesMoveTheBounds) {
  const TriangleMesh flat = make_box({1.0, 1.0, 1.0});
  const GeometryId soft = world.add(flat, true);
  TriangleMesh wide = flat;
  for (glm::vec3& p : wide.positions_m)
    p.x *= 20.0f;
  const EntityId before = world.create(row_of(soft, {12.0, 0.0, 0.0}), 0);
  const auto query = world.watch(definition);
  EXPECT_TRUE(events(*query, 0).empty());
  world.execute([&](Transaction& transaction) { transaction.update_geometry(soft, wide.positions_m); }, 10);
  EXPECT_EQ(events(*query, 10), (std::vector<Effect>{{enter, before}}));
  // A query registered later uses the current shape.
  const auto later = world.watch(definition);
  Members members;
  members.take(events_of(world, *later));
  EXPECT_EQ(members.all(), std::vector{before});
  world.execute([&](Transaction& transaction) { transaction.update_geometry(soft, flat.positions_m); }, 20);
  EXPECT_EQ(events(*query, 20), (std::vector<Effect>{{exit, before}}));
}

/// With many entities, distant ones are outside of the guard; with few, they become members.
TEST_F(Writes, ThatRemoveNearEntitiesLetDistantOnesEnter) {
  StandingNearest point;
  point.k = 3;
  std::vector<EntityId> near;
  near.reserve(60);
  for (int k = 0; k < 60; ++k)
    near.push_back(world.create(row_of(cube, {2.0 * k, 0.0, 0.0}), 0));
  const auto query = world.watch(point);
  Members members;
  members.take(events_of(world, *query));
  EXPECT_EQ(members.all(), (std::vector<EntityId>{near[0], near[1], near[2]}));
  world.execute(
      [&](Transaction& transaction) {
        for (std::size_t k = 1; k < near.size(); ++k)
          transaction.remove(near[k]);
      },
      10);
  members.take(events_of(world, *query));
  EXPECT_EQ(members.all(), std::vector{near[0]});
  const EntityId far = world.create(row_of(cube, {900.0, 0.0, 0.0}), 20);
  EXPECT_EQ(events(*query, 20), (std::vector<Effect>{{enter, far}}));
}

/// Of the entities that contain the point, the one with the lowest index is the nearest.
TEST_F(Writes, KeepTheLowestIndexOfEntitiesAroundThePoint) {
  const EntityId low = world.create(row_of(cube, {-3.0, 0.0, 0.0}, {1.0, 0.0, 0.0}), 0);
  const EntityId high = world.create(row_of(cube), 0);
  const auto query = world.watch(StandingNearest{});
  world.pass(4'000'000'000);
  const auto events = events_of(world, *query);
  ASSERT_EQ(events.size(), 7u);  // reset, present, complete; low enters, high exits, and back
  EXPECT_EQ(events[1].entity, high);
  EXPECT_EQ(events[3].entity, low);
  EXPECT_EQ(events[3].kind, enter);
  EXPECT_NEAR(static_cast<double>(events[3].time.time_since_epoch().count()), 2.5e9, 10.0);
  EXPECT_EQ(events[5].entity, low);
  EXPECT_EQ(events[5].kind, exit);
  EXPECT_NEAR(static_cast<double>(events[5].time.time_since_epoch().count()), 3.5e9, 10.0);
}

}  // namespace
}  // namespace rtstdb::standing::test
