// Losses are reported: full event rings, full change feeds, memory exhaustion.

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <thread>

#include "followed_world.hpp"
#include "tests/support/failing_new.hpp"

namespace rtstdb::standing::test {
namespace {

using hil::tests::fail_allocations_of;
using hil::tests::stop_failing_allocations;

StandingRegion around_origin(float half_m) {
  StandingRegion definition;
  definition.region.half_extent_m = {half_m, half_m, half_m};
  return definition;
}

/// Fetches until the list of members is complete.
void take_until_complete(FollowedWorld& world, StandingQuery& query, Members& members) {
  ASSERT_TRUE(hil::tests::eventually(
      [&] {
        members.take(events_of(world, query));
        return members.complete(query);
      },
      event_limit));
  // Events after `complete`.
  members.take(events_of(world, query));
}

TEST(Loss, OfEventsIsCountedAndTheMembersAreListedAgain) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const auto definition = around_origin(5.0f);
  const auto query = world.watch(definition, {.name = "gate", .ring_capacity = 8});
  Members members;
  take_until_complete(world, *query, members);
  std::vector<EntityId> made;
  made.reserve(100);
  for (int k = 0; k < 100; ++k)
    made.push_back(world.create(row_of(cube), k));
  world.catch_up(*query);
  EXPECT_EQ(query->lost(), 92u);
  std::array<StandingEvent, 8> first;
  ASSERT_EQ(query->next_events(first), 8u);
  for (const StandingEvent& event : first)
    EXPECT_EQ(event.kind, EventKind::enter);
  // The list is longer than the ring and arrives in pieces.
  std::vector<StandingEvent> all;
  ASSERT_TRUE(hil::tests::eventually(
      [&] {
        for (const StandingEvent& event : events_of(world, *query))
          all.push_back(event);
        return !all.empty() && all.back().kind == EventKind::complete;
      },
      event_limit));
  ASSERT_EQ(all.size(), 102u);
  EXPECT_EQ(all.front().kind, EventKind::reset);
  EXPECT_EQ(all.front().lost, 92u);
  EXPECT_EQ(all.front().seq, first.back().seq + 93) << "lost events have numbers";
  members.take(all);
  EXPECT_EQ(members.all(), made);
  EXPECT_EQ(query->lost(), 92u);
}

/// A slow reader and writers that do not wait for it: at each `complete` and at the end the membership is
/// correct.
TEST(Loss, OfASlowReaderEndsWithCorrectMembers) {
  std::mt19937 random(5);
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const auto definition = around_origin(8.0f);
  const auto query = world.watch(definition, {.name = "gate", .ring_capacity = 4});
  std::vector<EntityId> alive;
  Members members;
  std::array<StandingEvent, 3> some;
  std::uint64_t last_seq = 0;
  std::uint64_t missing = 0;
  const auto take = [&](std::span<const StandingEvent> events) {
    for (const StandingEvent& event : events) {
      missing += event.seq - last_seq - 1;
      last_seq = event.seq;
      members.take(event);
    }
  };
  for (int k = 0; k < 600; ++k) {
    const std::int64_t now_ns = std::int64_t{k} * 20'000'000;
    const EntityRow row = random_row_in_plane(random, cube);
    if (alive.size() < 30) {
      alive.push_back(world.create(row, now_ns));
    } else {
      world.update(alive[random() % alive.size()], row, now_ns);
    }
    if (random() % 16 == 0) take(std::span(some).first(query->next_events(some)));
    // So that the follower evaluates in between: at the end only, all events would fit into the ring.
    if (k % 50 == 49) world.catch_up(*query);
  }
  EXPECT_GT(query->lost(), 0u);
  ASSERT_TRUE(hil::tests::eventually(
      [&] {
        take(events_of(world, *query));
        return members.complete(*query);
      },
      event_limit));
  EXPECT_EQ(members.all(), world.entities_in(definition));
  EXPECT_EQ(missing, query->lost());
  EXPECT_EQ(members.reported_lost(), query->lost());
}

/// Commits that do not fit into the feed: their effects have EventCause::gap; crossings of other entities
/// keep their times.
TEST(Loss, OfCommitsInAFullFeedIsCaughtUp) {
  FollowedWorld world({.max_entities = 256, .feed_capacity = 8});
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const EntityId crosses = world.create(row_of(cube, {-7.5, 0.0, 0.0}, {1.0, 0.0, 0.0}), 0);
  const EntityId stays = world.create(row_of(cube), 0);
  const EntityId leaves = world.create(row_of(cube, {1.0, 0.0, 0.0}), 0);
  const auto definition = around_origin(5.0f);
  const auto region = world.watch(definition);
  StandingNearest point;
  point.k = 1;
  const auto nearest = world.watch(point);
  Members members;
  Members nearest_members;
  take_until_complete(world, *region, members);
  take_until_complete(world, *nearest, nearest_members);
  std::vector<EntityId> entered;
  world.execute(
      [&](Transaction& transaction) {
        transaction.remove(leaves);
        transaction.remove(stays);
        for (int k = 0; k < 20; ++k)
          transaction.create(row_of(cube, {0.0, 0.1 * k, 0.0}));
      },
      9'000'000'000);
  for (std::uint32_t k = 0; k < 20; ++k)
    entered.push_back(world.created(k));
  const auto events = events_of(world, *region);
  members.take(events);
  EXPECT_EQ(members.all(), world.entities_in(definition));
  ASSERT_EQ(events.size(), 1u + 2u + 20u);
  EXPECT_EQ(events[0].cause, EventCause::motion);
  EXPECT_EQ(events[0].entity, crosses);
  EXPECT_NEAR(static_cast<double>(events[0].time.time_since_epoch().count()), 2e9, 5.0);
  for (std::size_t k = 1; k < events.size(); ++k) {
    EXPECT_EQ(events[k].cause, EventCause::gap);
    EXPECT_EQ(events[k].time, at_ns(9'000'000'000));
  }
  nearest_members.take(events_of(world, *nearest));
  EXPECT_EQ(nearest_members.all(),
            std::vector{entered[0].index < entered[1].index ? entered[0] : entered[1]});
  const StandingCounts counts = world.follower().counts();
  EXPECT_EQ(counts.gaps, 1u);
  EXPECT_EQ(counts.skipped_versions, 1u);
  // The evaluation continues.
  world.remove(entered[5], 9'500'000'000);
  const auto after = events_of(world, *region);
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(after[0].cause, EventCause::write);
}

/// Commits at full speed with a feed of few rows: after any number of gaps, the members are correct at the
/// end.
TEST(Loss, OfManyGapsEndsWithCorrectMembers) {
  std::mt19937 random(11);
  FollowedWorld world({.max_entities = 512, .feed_capacity = 4}, 256);
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityId> alive;
  alive.reserve(300);
  for (int k = 0; k < 300; ++k)
    alive.push_back(world.create(random_row_in_plane(random, cube), 0));
  const auto definition = around_origin(8.0f);
  const auto query = world.watch(definition, {.name = "gate", .ring_capacity = 1 << 16});
  Members members;
  for (int k = 0; k < 400; ++k) {
    world.execute(
        [&](Transaction& transaction) {
          for (int n = 0; n < 4; ++n)
            transaction.update(alive[random() % alive.size()], random_row_in_plane(random, cube));
        },
        std::int64_t{k} * 1'000'000);
    if (k % 16 == 0)
      world.execute(
          [&](Transaction& transaction) {
            for (int n = 0; n < 5; ++n)
              transaction.update(alive[random() % alive.size()], random_row_in_plane(random, cube));
          },
          std::int64_t{k} * 1'000'000);
  }
  take_until_complete(world, *query, members);
  EXPECT_EQ(members.all(), world.entities_in(definition));
  EXPECT_GT(world.follower().counts().gaps, 0u);
  EXPECT_EQ(query->lost(), 0u);
}

/// A query that runs out of memory fails with a reason; the other queries and the database continue.
TEST(OutOfMemory, FailsTheQueryWithItsReason) {
  FollowedWorld world({.max_entities = 4096});
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const auto query = world.watch(around_origin(5.0f), {.name = "gate"});
  Members members;
  take_until_complete(world, *query, members);
  fail_allocations_of("rtstdb follower", 0);
  world.execute(
      [&](Transaction& transaction) {
        for (int k = 0; k < 900; ++k)
          transaction.create(row_of(cube, {100.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}));
      },
      1000);
  ASSERT_TRUE(
      hil::tests::eventually([&] { return query->status() != StandingStatus::following; }, event_limit));
  EXPECT_EQ(query->status(), StandingStatus::failed);
  EXPECT_EQ(query->reason(), "standing query 'gate': no memory was left to follow it");
  stop_failing_allocations();
  // It can be registered again.
  const auto again = world.watch(around_origin(5.0f));
  world.pass(120'000'000'000);
  Members later;
  take_until_complete(world, *again, later);
  EXPECT_TRUE(later.all().empty());
  EXPECT_EQ(query->status(), StandingStatus::failed);
}

/// The follower runs out of memory at any allocation: an error at registration, or a failed query later, and
/// nothing else.
TEST(OutOfMemory, IsReportedAtAnyAllocation) {
  int refused = 0;
  int failed = 0;
  int unaffected = 0;
  for (int after = 0; after < 40; ++after) {
    FollowedWorld world;
    const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
    for (int k = 0; k < 30; ++k)
      world.create(row_of(cube, {-10.0 - k, 0.0, 0.0}, {10.0, 0.0, 0.0}), 0);
    fail_allocations_of("rtstdb follower", after);
    StandingNearest nearest;
    nearest.k = 3;
    const auto spec =
        after % 2 == 0 ? make_query_spec(nearest, "gate") : make_query_spec(around_origin(5.0f), "gate");
    auto made = world.follower().watch(spec.value(), {.name = "gate"});
    for (int k = 0; k < 60; ++k)
      world.create(row_of(cube, {-30.0 - k, 0.0, 0.0}, {10.0, 0.0, 0.0}), 1'000'000 * k);
    world.pass(2'000'000'000);
    if (!made) {
      EXPECT_EQ(made.error().code, ErrorCode::out_of_memory);
      ++refused;
    } else {
      world.catch_up(*made.value());
      ++(made.value()->status() == StandingStatus::failed ? failed : unaffected);
    }
    stop_failing_allocations();
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(failed, 0);
  EXPECT_GT(unaffected, 0);
}

}  // namespace
}  // namespace rtstdb::standing::test
