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

EntityRow somewhere(std::mt19937& random, GeometryId cube) {
  const auto anywhere = [&] { return static_cast<double>(random() % 400) / 10.0 - 20.0; };
  return row_of(cube, {anywhere(), anywhere(), 0.0}, {anywhere(), anywhere(), 0.0});
}

TEST(Threads, WritersReadersAndShortLivedQueries) {
  FollowedWorld world({.max_entities = 256, .feed_capacity = 256});
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  std::mt19937 random(3);
  std::vector<EntityId> alive;
  alive.reserve(50);
  for (int k = 0; k < 50; ++k)
    alive.push_back(world.create(somewhere(random, cube), 0));
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
    const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(5);
    world.catch_up(*lasting);
    do {
      while (fetch() > 0) {
      }
      ASSERT_LT(std::chrono::steady_clock::now(), patience);
    } while (!members.whole(*lasting));
    while (fetch() > 0) {
    }
    Region region = definition.region;
    const oracle::World rows = world.rows();
    region.t = rows.version_time();
    EXPECT_EQ(members.all(), oracle::found(oracle::gaps(rows, region)));
  });
  std::vector<std::thread> guests;
  std::atomic<int> came{0};
  for (std::uint32_t guest = 0; guest < 3; ++guest) {
    guests.emplace_back([&, guest] {
      std::mt19937 own(guest);
      std::array<StandingEvent, 64> some;
      while (!over.load()) {
        std::unique_ptr<StandingQuery> query;
        if (own() % 2 == 0) {
          query = world.watch(definition, {.name = "gate", .ring_capacity = 8});
        } else {
          StandingNearest nearest;
          nearest.k = 1 + static_cast<std::uint32_t>(own() % 6);
          query = world.watch(nearest, {.name = "gate", .ring_capacity = 8});
        }
        ++came;
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
      std::mt19937 own(100 + writer);
      const auto transaction = world.engine().make_transaction({.max_writes = 4});
      while (written.fetch_add(1) < versions) {
        Terms terms;
        terms.world_time = world.engine().latest().time + Nanoseconds(own() % 3 * 1'000'000);
        transaction->begin(terms);
        for (int n = 0; n < 3; ++n)
          transaction->update(alive[own() % alive.size()], somewhere(own, cube));
        world.engine().submit(*transaction);
        world.engine().wait(*transaction);  // refused if another writer has advanced the time further
      }
    });
  }
  for (std::thread& writer : writers)
    writer.join();
  over = true;
  for (std::thread& guest : guests)
    guest.join();
  reader.join();
  EXPECT_GT(came.load(), 0);
  EXPECT_GT(world.engine().counts().committed, static_cast<std::uint64_t>(versions) / 4);
}

TEST(Threads, ClosingTheDatabaseEndsTheFollower) {
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
