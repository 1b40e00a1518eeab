// Standing queries of a whole database: after all events of a version the members are the entities that
// one-shot queries find on the device at that version, except for entities so close to the border that single
// precision can not decide.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "tests/gpu/database_fixture.hpp"

namespace rtstdb::test {
namespace {

class StandingTest : public DatabaseTest {
 protected:
  double from(double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 100'000) / 1e5;
  }
  glm::dvec3 random_vector(double size) { return {from(-size, size), from(-size, size), from(-size, size)}; }

  EntityRow random_row(WorldTime now) {
    EntityRow row = row_of(random() % 2 == 0 ? box : bar, random_vector(10.0));
    row.motion.q_world = glm::normalize(glm::dquat(1.0, from(-1, 1), from(-1, 1), from(-1, 1)));
    row.motion.v_world_mps = random_vector(20.0);
    row.motion.w_world_radps = random_vector(3.0);
    row.motion.valid_from = now;
    return row;
  }

  /// Reads the events of a query.
  struct Reader {
    std::unique_ptr<StandingQuery> query;
    std::vector<EntityId> members;

    void read_until(Version version) {
      const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(5);
      while (query->progress().version < version) {
        ASSERT_LT(std::chrono::steady_clock::now(), end);
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

  template <class Definition>
  Reader watch(const Definition& definition) {
    auto made = database().watch(definition, {.name = "standing", .ring_capacity = 4096});
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return {std::move(made).value(), {}};
  }

  std::mt19937 random{17};
  GeometryId box, bar;
};

/// Stands still.
class VirtualClock final : public Clock {
 public:
  ClockTime now() const noexcept override { return clock_time_ns(1); }
  bool is_virtual() const noexcept override { return true; }
};

TEST_F(StandingTest, UnderAVirtualClockEventsAreThereAfterWait) {
  static const VirtualClock clock;  // outlives the database of the fixture
  open({.clock = &clock});
  box = add(make_box({1.0, 1.0, 1.0}));
  const EntityId body = create(row_of(box, {9.0, 0.0, 0.0}));
  StandingRegion gate{.region = region_of(RegionShape::box, RegionTest::touching, {}, {1.0f, 1.0f, 1.0f}),
                      .excluded = {}};
  Reader reader = watch(gate);
  std::array<StandingEvent, 8> events;
  ASSERT_EQ(reader.query->next_events(events), 2u) << "an empty list";
  for (std::int64_t k = 1; k <= 1000; ++k) {
    Motion motion;
    motion.p_world_m.x = k % 2 == 1 ? 0.0 : 9.0;
    update_motion(body, motion, world_time_ns(k));
    ASSERT_EQ(reader.query->next_events(events), 1u) << k;
    EXPECT_EQ(events[0].kind, k % 2 == 1 ? EventKind::enter : EventKind::exit);
  }
}

TEST_F(StandingTest, HasTheMembersThatOneShotQueriesFind) {
  box = add(make_box({2.0, 1.0, 1.0}));
  bar = add(make_box({4.0, 0.3, 0.2}));
  std::vector<EntityRow> rows;
  for (int k = 0; k < 60; ++k)
    rows.push_back(random_row({}));
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
  std::vector<Reader> standing_regions;
  for (const Region& region : regions)
    standing_regions.push_back(watch(StandingRegion{.region = region, .excluded = {}}));
  Nearest point;
  point.point_m = {0.5f, 0.0f, 0.0f};
  point.carrier = point.excluded = ids[1];
  constexpr std::uint32_t k_nearest = 4;
  Reader standing_nearest = watch(StandingNearest{.point = point, .k = k_nearest});
  // From outside of all bounds, which are equal to the bodies here.
  Ray ray = ray_from({-200.0f, 0.3f, 0.2f}, {1.0f, 0.01f, -0.02f});
  Reader standing_ray = watch(StandingRay{.ray = ray, .excluded = {}});

  const auto region_query = prepare(RegionQueryOptions{.name = "regions", .capacity = 16});
  const auto nearest_query = prepare(
      NearestQueryOptions{.name = "nearest", .capacity = 1, .target = NearestTarget::bounds, .k = k_nearest});
  const auto ray_query = prepare(RayQueryOptions{
      .name = "ray", .capacity = 1, .mode = RayMode::first, .hits_per_ray = max_hits_per_ray});
  std::size_t compared = 0;
  std::size_t members = 0;
  std::size_t too_close = 0;
  for (int version = 1; version <= 60; ++version) {
    const WorldTime now = at_s(0.02 * version);
    for (Region& region : regions)
      region.t = now;
    point.t = ray.t = now;
    std::ranges::copy(regions, region_query->regions().begin());
    nearest_query->points()[0] = point;
    ray_query->rays()[0] = ray;
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          for (int n = 0; n < 3; ++n)
            transaction.update(ids[2 + random() % 40], random_row(now));
          if (version % 3 == 0) transaction.update_motion(ids[random() % 2], random_row(now).motion);
          if (version % 4 == 0) {
            transaction.remove(ids.back());
            ids.pop_back();
          }
          transaction.add_query(*region_query, static_cast<std::uint32_t>(regions.size()));
          transaction.add_query(*nearest_query, 1);
          transaction.add_query(*ray_query, 1);
        },
        now);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    const oracle::World world = this->world();
    for (std::size_t k = 0; k < regions.size(); ++k) {
      ASSERT_NO_FATAL_FAILURE(standing_regions[k].read_until(outcome.version));
      const RegionAnswer& answer = region_query->answers()[k];
      ASSERT_FALSE(answer.overflow || answer.incomplete);
      for (const oracle::EntityGap& gap : oracle::gaps(world, regions[k])) {
        const bool is_found = std::ranges::binary_search(answer.entities, gap.entity);
        ++compared;
        members += is_found ? 1 : 0;
        if (std::abs(gap.gap_m) <= gap.noise_m) {
          ++too_close;
          continue;
        }
        EXPECT_EQ(standing_regions[k].holds(gap.entity), is_found)
            << "region " << k << ", version " << version;
      }
    }
    ASSERT_NO_FATAL_FAILURE(standing_nearest.read_until(outcome.version));
    std::vector<EntityId> nearest;
    for (const Neighbor& neighbor : nearest_query->answers()[0].neighbors)
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
    ASSERT_NO_FATAL_FAILURE(standing_ray.read_until(outcome.version));
    std::vector<EntityId> hit_entities;
    for (const RayHit& hit : ray_query->hits())
      if (hit.status == HitStatus::hit) hit_entities.push_back(hit.entity);
    std::ranges::sort(hit_entities);
    hit_entities.erase(std::unique(hit_entities.begin(), hit_entities.end()), hit_entities.end());
    ASSERT_LT(hit_entities.size(), max_hits_per_ray / 2);
    // Entities for which a ray a tenth of a millimetre beside it has another result.
    std::vector<EntityId> doubtful;
    for (const glm::vec3 offset_m : {glm::vec3{0, 1e-4f, 0}, {0, -1e-4f, 0}, {0, 0, 1e-4f}, {0, 0, -1e-4f}}) {
      Ray shifted = ray;
      shifted.origin_m += offset_m;
      std::vector<EntityId> found;
      for (const oracle::RayTruth& hit : oracle::trace_all(world, shifted))
        found.push_back(hit.entity);
      for (const EntityState& state : world.entities())
        if ((std::ranges::find(found, state.id) != found.end()) !=
            std::ranges::binary_search(hit_entities, state.id))
          doubtful.push_back(state.id);
    }
    for (const EntityState& state : world.entities()) {
      if (std::ranges::find(doubtful, state.id) != doubtful.end()) {
        ++too_close;
      } else {
        EXPECT_EQ(standing_ray.holds(state.id), std::ranges::binary_search(hit_entities, state.id))
            << "version " << version;
      }
    }
  }
  EXPECT_GT(members, compared / 20);
  EXPECT_LT(too_close, compared / 500);
}

/// A new standing query reads the bounds of all deforming geometries.
TEST_F(StandingTest, BeginsWhileGeometriesAreAdded) {
  box = bar = add(make_box({2.0, 1.0, 1.0}));
  create(std::vector{random_row({})});
  std::atomic<bool> done{false};
  std::thread adding([&] {
    const TriangleMesh sphere = make_sphere(1.0, 4);
    for (int k = 0; k < 60; ++k) {
      const auto added = database().add_geometry(sphere, "sphere " + std::to_string(k), {.deforms = true});
      EXPECT_TRUE(added.ok()) << (added.ok() ? "" : added.error().message);
    }
    done = true;
  });
  StandingRegion everywhere;
  everywhere.region.half_extent_m = glm::vec3(1000.0f);
  std::uint64_t watched = 0;
  while (!done) {
    const Reader reader = watch(everywhere);
    ++watched;
  }
  adding.join();
  EXPECT_GT(watched, 10u);
}

}  // namespace
}  // namespace rtstdb::test
