// Threads that wait for the follower, as the owner of a commit does under a virtual clock.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

StandingRegion gate() {
  StandingRegion definition;
  definition.region.half_extent_m = {1.0f, 9.0f, 9.0f};
  return definition;
}

Motion at_x(double x_m, std::int64_t ns) {
  Motion motion;
  motion.p_world_m.x = x_m;
  motion.valid_from = at_ns(ns);
  return motion;
}

TEST(FollowerWait, EventsOfAVersionAreThereAfterIt) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  EntityRow row;
  row.geometry = cube;
  row.motion = at_x(9.0, 0);
  const EntityId body = world.create(row, 0);
  world.follower().wait_until_evaluated(world.engine().latest().version);  // there is no query
  const auto query = world.watch(gate());
  std::array<StandingEvent, 8> events;
  ASSERT_EQ(query->next_events(events), 2u) << "reset and complete";
  for (std::int64_t k = 1; k <= 2000; ++k) {
    world.update_motion(body, at_x(k % 2 == 1 ? 0.0 : 9.0, k * 1000), k * 1000);
    const Version version = world.engine().latest().version;
    world.follower().wait_until_evaluated(version);
    ASSERT_EQ(query->next_events(events), 1u) << k;
    EXPECT_EQ(events[0].kind, k % 2 == 1 ? EventKind::enter : EventKind::exit);
    EXPECT_EQ(events[0].version, version);
  }
}

TEST(FollowerWait, SeveralThreadsWaitAtTheSameTime) {
  FollowedWorld world;
  const auto query = world.watch(gate());
  std::atomic<Version> published{0};
  std::atomic<bool> over{false};
  std::vector<std::thread> waiters;
  for (int k = 0; k < 3; ++k) {
    waiters.emplace_back([&] {
      while (!over) {
        const Version version = published;
        world.follower().wait_until_evaluated(version);
        EXPECT_GE(query->progress().version, version);
      }
    });
  }
  for (std::int64_t k = 1; k <= 500; ++k) {
    world.pass(k);
    published = world.engine().latest().version;
  }
  over = true;
  for (std::thread& waiter : waiters)
    waiter.join();
}

TEST(FollowerWait, EndsWithTheLastQueryAndWithTheDatabase) {
  FollowedWorld world;
  for (int k = 1; k <= 50; ++k) {
    auto query = world.watch(gate());
    world.pass(k);
    const Version version = world.engine().latest().version;
    std::thread waiter([&] { world.follower().wait_until_evaluated(version); });
    query.reset();
    waiter.join();
  }
  const auto query = world.watch(gate());
  world.pass(100);
  std::thread waiter([&] { world.follower().wait_until_evaluated(world.engine().latest().version); });
  world.follower().close();
  waiter.join();
  EXPECT_EQ(query->status(), StandingStatus::failed);
}

/// Under a virtual clock the list of members comes with a version, not when events were fetched.
TEST(FollowerWait, AListAfterALossComesWithTheNextVersion) {
  FollowedWorld world({.max_entities = 256, .is_virtual = true});
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  EntityRow row;
  row.geometry = cube;
  row.motion = at_x(9.0, 0);
  const EntityId body = world.create(row, 0);
  const auto query = world.watch(gate(), {.name = "gate", .ring_capacity = 4});
  const auto jump = [&](std::int64_t k) {
    world.update_motion(body, at_x(k % 2 == 1 ? 0.0 : 9.0, k), k);
    world.follower().wait_until_evaluated(world.engine().latest().version);
  };
  std::array<StandingEvent, 8> events;
  ASSERT_EQ(query->next_events(events), 2u);
  for (std::int64_t k = 1; k <= 7; ++k)
    jump(k);
  EXPECT_EQ(query->lost(), 3u);
  EXPECT_EQ(query->next_events(events), 4u);
  // Another thread has time to do what it must not do. Time is the subject.
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(query->next_events(events), 0u);
  jump(9);  // it stays in the gate
  ASSERT_EQ(query->next_events(events), 3u);
  EXPECT_EQ(events[0].kind, EventKind::reset);
  EXPECT_EQ(events[0].lost, 3u);
  EXPECT_EQ(events[1].kind, EventKind::present);
  EXPECT_EQ(events[2].kind, EventKind::complete);
}

}  // namespace
}  // namespace rtstdb::standing::test
