// A loop over a large moving world: each tick changes one entity and runs small batches, by which slots are
// made ahead (counted in tlas_ahead_test.cpp). In about 60 ticks of each loop all answers are compared with
// the oracle.

#include <algorithm>

#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t loop_entities = 2600;
constexpr std::uint32_t element_count = 24;

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
  /// Gives one entity the velocities of another and a new position.
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
TEST_P(MovingLoop, AgreesWithTheOracle) {
  open({.max_entities = 4096});
  begin();
  const NearestQueryOptions near{
      .name = "near", .capacity = element_count, .target = NearestTarget::surface, .k = 3};
  const auto rays = prepare_rays(RayMode::closest, false, element_count);
  const auto regions =
      prepare(RegionQueryOptions{.name = "regions", .capacity = element_count, .ids_per_region = 4096});
  const auto points = prepare(near);
  const auto known = database().snapshot({}).value();
  Tally tally;
  const int ticks = static_cast<int>(1.6 / GetParam());
  for (int k = 0; k < ticks && !HasFailure(); ++k) {
    time_ += Nanoseconds(static_cast<std::int64_t>(GetParam() * 1e9));
    for (Ray& ray : rays->rays())
      ray = random_ray(random_, known, scene_, time_, 0.0);
    for (Region& region : regions->regions())
      region = random_region(random_, known, scene_, time_, 0.0);
    for (Nearest& point : points->points())
      point = random_point(random_, known, scene_, time_, 0.0);
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          change_one(transaction, known);
          transaction.add_query(*rays, element_count);
          transaction.add_query(*regions, element_count);
          transaction.add_query(*points, element_count);
        },
        time_);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    if (k * 60 / ticks == (k - 1) * 60 / ticks) continue;
    const oracle::World now = world();
    tally += judge(now, rays->rays(), rays->hits());
    tally += judge(now, regions->regions(), regions->answers());
    tally += judge(now, points->points(), points->answers(), near);
  }
  EXPECT_GT(tally.elements, 50u * 3u * element_count);
  EXPECT_GT(tally.hits, tally.elements / 5);
}

INSTANTIATE_TEST_SUITE_P(Periods, MovingLoop, testing::Values(0.002, 0.01));

}  // namespace
}  // namespace rtstdb::test
