// Many threads at the same time: writers commit, readers fetch, queries are registered and destroyed. For the
// thread sanitizer, and for the consistency of the events.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <random>
#include <thread>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int versions = 300;
#else
constexpr int versions = 1500;
#endif

TEST(ConcurrentUse, OfWritersReadersAndShortLivedQueriesKeepsEventsConsistent) {
  FollowedWorld world({.max_entities = 256, .feed_capacity = 256});
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  std::mt19937 random(3);
  std::vector<EntityId> alive;
  alive.reserve(50);
  for (int k = 0; k < 50; ++k)
    alive.push_back(world.create(random_row_in_plane(random, cube), 0));
  StandingRegion definition;
  definition.region.half_extent_m = {8.0f, 8.0f, 8.0f};
  const auto lasting = world.watch(definition, {.name = "gate", .ring_capacity = 32});
  std::atomic<bool> over{false};

  std::thread reader([&] {
    Members members;
    std::array<StandingEvent, 16> some;
    const auto fetch = [&] {
      const std::size_t count = lasting->next_events(some);
      members.take(std::span(some).first(count));
      return count;
    };
    while (!over.load())
      fetch();
    // Members checks that the events are consistent. After the last list, it is correct.
    world.catch_up(*lasting);
    ASSERT_TRUE(hil::tests::eventually(
        [&] {
          while (fetch() > 0) {
          }
          return members.complete(*lasting);
        },
        event_limit));
    while (fetch() > 0) {
    }
    EXPECT_EQ(members.all(), world.entities_in(definition));
  });
  std::vector<std::thread> watchers;
  std::atomic<int> registered{0};
  for (std::uint32_t watcher = 0; watcher < 3; ++watcher) {
    watchers.emplace_back([&, watcher] {
      std::mt19937 watcher_random(watcher);
      std::array<StandingEvent, 64> some;
      while (!over.load()) {
        std::unique_ptr<StandingQuery> query;
        if (watcher_random() % 2 == 0) {
          query = world.watch(definition, {.name = "gate", .ring_capacity = 8});
        } else {
          StandingNearest nearest;
          nearest.k = 1 + static_cast<std::uint32_t>(watcher_random() % 6);
          query = world.watch(nearest, {.name = "gate", .ring_capacity = 8});
        }
        ++registered;
        Members members;
        for (int k = 0; k < 20; ++k) {
          members.take(std::span(some).first(query->next_events(some)));
          std::this_thread::yield();
        }
        static_cast<void>(query->progress());
        static_cast<void>(query->reason());
      }
    });
  }
  std::vector<std::thread> writers;
  std::atomic<int> written{0};
  for (std::uint32_t writer = 0; writer < 3; ++writer) {
    writers.emplace_back([&, writer] {
      std::mt19937 writer_random(100 + writer);
      const auto transaction = world.engine().make_transaction({.max_writes = 4});
      while (written.fetch_add(1) < versions) {
        Terms terms;
        terms.world_time = world.engine().latest().time + Nanoseconds(writer_random() % 3 * 1'000'000);
        transaction->begin(terms);
        for (int n = 0; n < 3; ++n)
          transaction->update(alive[writer_random() % alive.size()],
                              random_row_in_plane(writer_random, cube));
        world.engine().submit(*transaction);
        world.engine().wait(*transaction);  // refused if another writer has advanced the time further
      }
    });
  }
  for (std::thread& writer : writers)
    writer.join();
  over = true;
  for (std::thread& watcher : watchers)
    watcher.join();
  reader.join();
  EXPECT_GT(registered.load(), 0);
  EXPECT_GT(world.engine().counts().committed, static_cast<std::uint64_t>(versions) / 4);
}

TEST(ConcurrentUse, EndsWhenTheDatabaseCloses) {
  for (int k = 0; k < 20; ++k) {
    FollowedWorld world;
    const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
    world.create(row_of(cube), 0);
    StandingRegion definition;
    definition.region.half_extent_m = {8.0f, 8.0f, 8.0f};
    auto query = world.watch(definition);
    world.create(row_of(cube), 0);
    query.reset();
    if (k % 2 == 0) query = world.watch(definition);
  }
}

}  // namespace
}  // namespace rtstdb::standing::test
