// A loop over a large world that moves: each tick changes little and asks little, while slots for the windows
// to come are made, with trees that are built in parts. Every so often all answers are held against the
// oracle's.

#include <algorithm>

#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t loop_entities = 2600;
constexpr std::uint32_t asked_each_time = 24;

class MovingLoop : public DatabaseTest, public testing::WithParamInterface<double> {
 protected:
  void begin() {
    scene_.radius_m = 60.0;
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random_))
      geometries.push_back(add(mesh));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < loop_entities; ++i)
      rows.push_back(random_row(random_, geometries, scene_, rows));
    ids_ = create(rows, scene_.version_time);
  }
  /// Like the row of another one of them, as of now.
  void change_one(Transaction& transaction, std::span<const EntityState> known) {
    Motion motion = known[random_.below(known.size())].row.motion;
    motion.p_world_m = 60.0 * random_.vector();
    motion.valid_from = time_;
    transaction.update_motion(ids_[random_.below(ids_.size())], motion);
  }

  Random random_{77};
  SceneOptions scene_;
  std::vector<EntityId> ids_;
  WorldTime time_ = at_s(0.0);
};

/// The parameter: the loop's period in seconds.
TEST_P(MovingLoop, IsAnsweredAsTheOracleDoes) {
  open({.max_entities = 4096});
  begin();
  const NearestQueryOptions near{
      .name = "near", .capacity = asked_each_time, .target = NearestTarget::surface, .k = 3};
  auto rays = database().prepare(RayQueryOptions{.name = "rays", .capacity = asked_each_time});
  auto regions = database().prepare(
      RegionQueryOptions{.name = "regions", .capacity = asked_each_time, .ids_per_region = 4096});
  auto points = database().prepare(near);
  ASSERT_TRUE(rays.ok() && regions.ok() && points.ok());
  const auto known = database().snapshot({}).value();
  Tally tally;
  const int ticks = static_cast<int>(1.6 / GetParam());
  for (int k = 0; k < ticks && !HasFailure(); ++k) {
    time_ += Nanoseconds(static_cast<std::int64_t>(GetParam() * 1e9));
    for (Ray& ray : rays.value()->rays())
      ray = random_ray(random_, known, scene_, time_, 0.0);
    for (Region& region : regions.value()->regions())
      region = random_region(random_, known, scene_, time_, 0.0);
    for (Nearest& point : points.value()->points())
      point = random_point(random_, known, scene_, time_, 0.0);
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          change_one(transaction, known);
          transaction.add_query(*rays.value(), asked_each_time);
          transaction.add_query(*regions.value(), asked_each_time);
          transaction.add_query(*points.value(), asked_each_time);
        },
        time_);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    if (k * 60 / ticks == (k - 1) * 60 / ticks) continue;
    const oracle::World now = world();
    tally += judge(now, rays.value()->rays(), rays.value()->hits());
    tally += judge(now, regions.value()->regions(), regions.value()->answers());
    tally += judge(now, points.value()->points(), points.value()->answers(), near);
  }
  EXPECT_GT(tally.elements, 50u * 3u * asked_each_time);
  EXPECT_GT(tally.hits, tally.elements / 5);
}

INSTANTIATE_TEST_SUITE_P(Periods, MovingLoop, testing::Values(0.002, 0.01));

}  // namespace
}  // namespace rtstdb::test
