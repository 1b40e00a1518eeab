// Standing queries of a whole database: after all events of a version the members are those that one-shot
// queries find there, on the device and in single precision, but for what lies nearer to the border than that
// can tell.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "tests/gpu/database_test.hpp"

namespace rtstdb::test {
namespace {

class StandingTest : public DatabaseTest {
 protected:
  double from(double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 100'000) / 1e5;
  }
  glm::dvec3 anywhere(double size) { return {from(-size, size), from(-size, size), from(-size, size)}; }

  EntityRow somewhere(WorldTime now) {
    EntityRow row = row_of(random() % 2 == 0 ? box : bar, anywhere(10.0));
    row.motion.q_world = glm::normalize(glm::dquat(1.0, from(-1, 1), from(-1, 1), from(-1, 1)));
    row.motion.v_world_mps = anywhere(20.0);
    row.motion.w_world_radps = anywhere(3.0);
    row.motion.valid_from = now;
    return row;
  }

  /// A reader of one query's events.
  struct Followed {
    std::unique_ptr<StandingQuery> query;
    std::vector<EntityId> members;

    void take(Version version) {
      const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(5);
      while (query->progress().version < version) {
        ASSERT_LT(std::chrono::steady_clock::now(), patience);
        std::this_thread::sleep_for(std::chrono::microseconds(50));
      }
      std::array<StandingEvent, 64> some;
      while (const std::size_t count = query->next_events(some)) {
        for (const StandingEvent& event : std::span(some).first(count)) {
          const auto place = std::ranges::lower_bound(members, event.entity);
          if (event.kind == EventKind::enter || event.kind == EventKind::present)
            members.insert(place, event.entity);
          if (event.kind == EventKind::exit) members.erase(place);
        }
      }
    }
    bool holds(EntityId id) const { return std::ranges::binary_search(members, id); }
  };

  template <class Asked>
  Followed follow(const Asked& asked) {
    auto made = database().watch(asked, {.name = "standing", .ring_capacity = 4096});
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return {std::move(made).value(), {}};
  }

  std::mt19937 random{17};
  GeometryId box, bar;
};

TEST_F(StandingTest, MembersAreWhoOneShotQueriesFind) {
  box = add(make_box({2.0, 1.0, 1.0}));
  bar = add(make_box({4.0, 0.3, 0.2}));
  std::vector<EntityRow> rows;
  for (int k = 0; k < 60; ++k)
    rows.push_back(somewhere({}));
  std::vector<EntityId> ids = create(rows);

  std::vector<Region> regions;
  for (const RegionShape shape : {RegionShape::box, RegionShape::sphere, RegionShape::frustum}) {
    for (const RegionTest test : {RegionTest::touching, RegionTest::inside}) {
      for (const bool carried : {false, true}) {
        Region region = region_of(shape, test, {1.0f, 0.5f, -0.5f}, {7.0f, 5.0f, 4.0f});
        region.carrier = carried ? ids[0] : EntityId{};
        regions.push_back(region);
      }
    }
  }
  std::vector<Followed> standing_regions;
  for (const Region& region : regions)
    standing_regions.push_back(follow(StandingRegion{.region = region, .excluded = {}}));
  Nearest point;
  point.point_m = {0.5f, 0.0f, 0.0f};
  point.carrier = point.excluded = ids[1];
  constexpr std::uint32_t k_nearest = 4;
  Followed standing_nearest = follow(StandingNearest{.point = point, .k = k_nearest});
  // From outside of all bounds, which here are the bodies themselves.
  Ray ray = ray_from({-200.0f, 0.3f, 0.2f}, {1.0f, 0.01f, -0.02f});
  Followed standing_ray = follow(StandingRay{.ray = ray, .excluded = {}});

  auto region_query = database().prepare(RegionQueryOptions{.name = "regions", .capacity = 16});
  auto nearest_query = database().prepare(
      NearestQueryOptions{.name = "nearest", .capacity = 1, .target = NearestTarget::bounds, .k = k_nearest});
  auto ray_query = database().prepare(RayQueryOptions{
      .name = "ray", .capacity = 1, .mode = RayMode::first, .hits_per_ray = max_hits_per_ray});
  ASSERT_TRUE(region_query && nearest_query && ray_query);
  std::size_t compared = 0;
  std::size_t members = 0;
  std::size_t too_close = 0;
  for (int version = 1; version <= 60; ++version) {
    const WorldTime now = at_s(0.02 * version);
    for (Region& region : regions)
      region.t = now;
    point.t = ray.t = now;
    std::ranges::copy(regions, region_query.value()->regions().begin());
    nearest_query.value()->points()[0] = point;
    ray_query.value()->rays()[0] = ray;
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          for (int n = 0; n < 3; ++n)
            transaction.update(ids[2 + random() % 40], somewhere(now));
          if (version % 3 == 0) transaction.update_motion(ids[random() % 2], somewhere(now).motion);
          if (version % 4 == 0) {
            transaction.remove(ids.back());
            ids.pop_back();
          }
          transaction.add_query(*region_query.value(), static_cast<std::uint32_t>(regions.size()));
          transaction.add_query(*nearest_query.value(), 1);
          transaction.add_query(*ray_query.value(), 1);
        },
        now);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    const oracle::World world = this->world();
    for (std::size_t k = 0; k < regions.size(); ++k) {
      ASSERT_NO_FATAL_FAILURE(standing_regions[k].take(outcome.version));
      const RegionAnswer& answer = region_query.value()->answers()[k];
      ASSERT_FALSE(answer.overflow || answer.incomplete);
      for (const oracle::EntityGap& gap : oracle::gaps(world, regions[k])) {
        const bool found = std::ranges::binary_search(answer.entities, gap.entity);
        ++compared;
        members += found ? 1 : 0;
        if (std::abs(gap.gap_m) <= gap.noise_m) {
          ++too_close;
          continue;
        }
        EXPECT_EQ(standing_regions[k].holds(gap.entity), found) << "region " << k << ", version " << version;
      }
    }
    ASSERT_NO_FATAL_FAILURE(standing_nearest.take(outcome.version));
    std::vector<EntityId> nearest;
    for (const Neighbor& neighbor : nearest_query.value()->answers()[0].neighbors)
      nearest.push_back(neighbor.entity);
    std::ranges::sort(nearest);
    const auto truth = oracle::nearest_brute_force(
        world, point, {.name = "nearest", .target = NearestTarget::bounds, .k = k_nearest + 1});
    const auto& last = truth[k_nearest - 1];
    const auto& next = truth[k_nearest];
    if (next.distance_m - last.distance_m > last.noise_m + next.noise_m) {
      EXPECT_EQ(standing_nearest.members, nearest) << "version " << version;
    } else {
      ++too_close;
    }
    ASSERT_NO_FATAL_FAILURE(standing_ray.take(outcome.version));
    std::vector<EntityId> met;
    for (const RayHit& hit : ray_query.value()->hits())
      if (hit.status == HitStatus::hit) met.push_back(hit.entity);
    std::ranges::sort(met);
    met.erase(std::unique(met.begin(), met.end()), met.end());
    ASSERT_LT(met.size(), max_hits_per_ray / 2);
    // Who is met by a ray a tenth of a millimetre beside it, or is not, lies too close to say.
    std::vector<EntityId> doubtful;
    for (const glm::vec3 aside_m : {glm::vec3{0, 1e-4f, 0}, {0, -1e-4f, 0}, {0, 0, 1e-4f}, {0, 0, -1e-4f}}) {
      Ray beside = ray;
      beside.origin_m += aside_m;
      std::vector<EntityId> here;
      for (const oracle::RayTruth& hit : oracle::trace_all(world, beside))
        here.push_back(hit.entity);
      for (const EntityState& state : world.entities())
        if ((std::ranges::find(here, state.id) != here.end()) != std::ranges::binary_search(met, state.id))
          doubtful.push_back(state.id);
    }
    for (const EntityState& state : world.entities()) {
      if (std::ranges::find(doubtful, state.id) != doubtful.end()) {
        ++too_close;
      } else {
        EXPECT_EQ(standing_ray.holds(state.id), std::ranges::binary_search(met, state.id))
            << "version " << version;
      }
    }
  }
  EXPECT_GT(members, compared / 20);
  EXPECT_LT(too_close, compared / 500);
}

/// Whoever begins to follow reads a whole version, and with it the bounds of all geometries that deform.
TEST_F(StandingTest, GeometriesMayComeWhileSomebodyBeginsToFollow) {
  box = bar = add(make_box({2.0, 1.0, 1.0}));
  create(std::vector{somewhere({})});
  std::atomic<bool> over{false};
  std::thread adding([&] {
    const TriangleMesh sphere = make_sphere(1.0, 4);
    for (int k = 0; k < 60; ++k) {
      const auto added = database().add_geometry(sphere, "sphere " + std::to_string(k), {.deforms = true});
      EXPECT_TRUE(added.ok()) << (added.ok() ? "" : added.error().message);
    }
    over = true;
  });
  StandingRegion everywhere;
  everywhere.region.half_extent_m = glm::vec3(1000.0f);
  std::uint64_t followed = 0;
  while (!over) {
    const Followed one = follow(everywhere);
    ++followed;
  }
  adding.join();
  EXPECT_GT(followed, 10u);
}

}  // namespace
}  // namespace rtstdb::test
