// The cost of standing queries, counted in examinations of entities, not in time, so that it is the same on
// every machine. The threads that commit and that fetch events do not allocate.

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "followed_world.hpp"
#include "tests/support/allocation_guard.hpp"

namespace rtstdb::standing::test {
namespace {

namespace allocation_guard = hil::allocation_guard;

/// 10,000 entities and one written row for each version: each query examines one entity, not the whole world.
TEST(Cost, OfAVersionDependsOnItsChanges) {
  FollowedWorld world({.max_entities = 12'000}, 1 << 15);
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityId> all;
  std::vector<std::uint32_t> ordinals;
  for (int row = 0; row < 10; ++row) {
    ordinals.clear();
    world.execute(
        [&](Transaction& transaction) {
          for (int k = 0; k < 1000; ++k)
            ordinals.push_back(transaction.create(row_of(cube, {2.0 * k - 1000.0, 20.0 * row - 100.0, 0.0})));
        },
        0);
    for (const std::uint32_t ordinal : ordinals)
      all.push_back(world.created(ordinal));
  }
  std::vector<std::unique_ptr<StandingQuery>> queries;
  StandingRegion region;
  region.region.half_extent_m = {30.0f, 30.0f, 5.0f};
  queries.push_back(world.watch(region));
  region.region.shape = RegionShape::sphere;
  queries.push_back(world.watch(region));
  region.region.shape = RegionShape::frustum;
  region.region.carrier = all[7];
  queries.push_back(world.watch(region));
  queries.push_back(world.watch(StandingRay{}));
  StandingNearest nearest;
  nearest.point.point_m = {0.5f, 10.5f, 0.0f};
  nearest.k = 4;
  queries.push_back(world.watch(nearest));
  const std::uint64_t at_registration = world.follower().counts().examinations;
  EXPECT_GT(at_registration, 4u * 10'000u) << "registration examines all entities";
  constexpr std::uint64_t versions = 400;
  for (std::uint64_t k = 0; k < versions; ++k) {
    EntityRow row = row_of(cube, {2.0 * static_cast<double>(k) - 400.0, 60.0, 0.0}, {0.0, -30.0, 0.0});
    row.motion.valid_from = at_ns(static_cast<std::int64_t>(k) * 1'000'000);
    world.update(all[100 + 13 * k], row, static_cast<std::int64_t>(k) * 1'000'000);
  }
  for (const auto& query : queries)
    world.catch_up(*query);
  const StandingCounts counts = world.follower().counts();
  // One examination of each written row for each query, one or two more for each crossing and each end of a
  // look-ahead, and pairs among the nearest: far below an examination of the whole world for each version,
  // which would be 16 million.
  const std::uint64_t examinations = counts.examinations - at_registration;
  EXPECT_GE(examinations, versions * 5);
  EXPECT_LT(examinations, versions * 5 * 20 + 5 * 10'000 * 3)
      << "entities within reach have three look-aheads in 0.4 s";
  EXPECT_EQ(counts.rows, versions);
}

TEST(Cost, CommitsDoNotAllocate) {
  threads::EventCount unused;
  ChangeFeed feed(4, unused);
  feed.make_space(64);
  const TriangleMesh soft = make_box({1.0, 1.0, 1.0});
  feed.keep_bounds(GeometryId{2}, Follower::used_positions(soft));
  feed.start();
  store::WriteSet set;
  for (int k = 0; k < 20; ++k)
    set.writes.push_back({store::WriteKind::create, {{static_cast<std::uint32_t>(k), 1}, EntityRow{}, 1}});
  set.shapes.push_back({GeometryId{2}, soft.positions_m.size(), soft.positions_m.size(), soft.positions_m});
  std::vector<Change> changes;
  allocation_guard::reset();
  for (int round = 0; round < 50; ++round) {
    for (int version = 0; version < 5; ++version) {  // the last ones do not fit
      ++set.version;
      allocation_guard::enter_tick();
      feed.committed(set);
      allocation_guard::leave_tick();
    }
    EXPECT_TRUE(feed.in_gap());
    while (feed.take_version(changes)) {
      EXPECT_EQ(changes.size(), 21u);
      EXPECT_TRUE(changes.back().last);
    }
    feed.start();
  }
  EXPECT_EQ(allocation_guard::seen().total(), 0u);
  EXPECT_EQ(feed.skipped(), 100u);
}

TEST(Cost, FetchingDoesNotAllocate) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  StandingRegion region;
  region.region.half_extent_m = {3.0f, 3.0f, 3.0f};
  const auto query = world.watch(region, {.name = "gate", .ring_capacity = 8});
  allocation_guard::reset();
  std::array<StandingEvent, 4> some;
  std::size_t fetched = 0;
  for (int k = 0; k < 60; ++k) {
    world.create(row_of(cube), k);
    allocation_guard::enter_tick();
    if (k % 3 == 0) fetched += query->next_events(some);
    static_cast<void>(query->progress());
    static_cast<void>(query->status());
    static_cast<void>(query->lost());
    allocation_guard::leave_tick();
  }
  EXPECT_EQ(allocation_guard::seen().total(), 0u);
  EXPECT_GT(fetched, 0u);
}

}  // namespace
}  // namespace rtstdb::standing::test
