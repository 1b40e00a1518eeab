// Random worlds with random writes and every kind of standing query, carried or not: events are compared with
// an independent reference. At many instants between versions, the reference computes the members with the
// oracle; where it is certain, the events up to the instant must agree. At each crossing, the oracle's
// distance must change its sign within some nanometres.

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int worlds = 1;
constexpr int samples_between = 32;
#else
constexpr int worlds = 12;
constexpr int samples_between = 64;
#endif
constexpr int versions = 40;
/// Nearer to the border than this, the reference is uncertain, except at a crossing.
constexpr double certain_m = 1e-6;
/// This long before and after a crossing, the sign must be the old and the new one.
constexpr Nanoseconds around{2000};
/// Largest distance from the border at a crossing: rounding, the thickness of the border, and a nanosecond at
/// up to 1 km/s.
constexpr double at_crossing_m = 1e-6;

struct Definition {
  explicit Definition(const StandingRegion& definition) : region(definition) {}
  explicit Definition(const StandingRay& definition) : ray(definition) {}
  explicit Definition(const StandingNearest& definition) : nearest(definition) {}

  std::optional<StandingRegion> region;
  std::optional<StandingRay> ray;
  std::optional<StandingNearest> nearest;
  EntityId carrier() const {
    return region ? region->region.carrier : ray ? ray->ray.carrier : nearest->point.carrier;
  }
  EntityId excluded() const {
    return region ? region->excluded : ray ? ray->excluded : nearest->point.excluded;
  }
};

/// Signed distance of an entity from being a member; negative inside.
struct Gap {
  EntityId entity;
  double gap_m = 0.0;
};

const EntityState* carrier_of(const oracle::World& world, EntityId carrier) {
  return carrier.valid() ? world.find(carrier) : nullptr;
}

Pose carrier_pose(const oracle::World& world, EntityId carrier, WorldTime t) {
  const EntityState* state = carrier_of(world, carrier);
  return state != nullptr ? pose_at(state->row.motion, t) : Pose{};
}

OrientedBox bounds_at(const oracle::World& world, const EntityState& state, WorldTime t) {
  return oriented_box(world.mesh_of(state).bounds(), state.row.scale, pose_at(state.row.motion, t));
}

double center_gap_m(const oracle::World& world, const Region& region, const glm::dvec3& center_m,
                    WorldTime t) {
  const Pose carrier = carrier_pose(world, region.carrier, t);
  const glm::dquat q = glm::normalize(glm::dquat(region.q));
  glm::dvec3 p =
      glm::conjugate(carrier.q_world) * (center_m - carrier.p_world_m) - glm::dvec3(region.center_m);
  const glm::dvec3 half(region.half_extent_m);
  if (region.shape == RegionShape::sphere) return glm::length(p) - half.x;
  p = glm::conjugate(q) * p;
  if (region.shape == RegionShape::box) {
    const glm::dvec3 beyond = glm::abs(p) - half;
    return std::max({beyond.x, beyond.y, beyond.z});
  }
  // Distances to the sides through the eye.
  const double side_m = (std::abs(p.y) * half.x - half.y * p.x) / std::hypot(half.x, half.y);
  const double roof_m = (std::abs(p.z) * half.x - half.z * p.x) / std::hypot(half.x, half.z);
  return std::max({p.x - half.x, static_cast<double>(region.near_m) - p.x, side_m, roof_m});
}

/// By how much the box has to grow until the ray hits it (negative: may shrink), by bisection with the slab
/// test.
double ray_gap_m(const oracle::World& world, const Ray& ray, const OrientedBox& box, WorldTime t) {
  const Pose carrier = carrier_pose(world, ray.carrier, t);
  const glm::dvec3 from_m = carrier.p_world_m + carrier.q_world * glm::dvec3(ray.origin_m) - box.center_m;
  const glm::dvec3 direction = carrier.q_world * glm::dvec3(ray.direction);
  const auto hits = [&](double grown_m) {
    double first = static_cast<double>(ray.lambda_min);
    double last = static_cast<double>(ray.lambda_max);
    for (int i = 0; i < 3; ++i) {
      const double half_m = box.half_extent_m[i] + grown_m;
      if (half_m < 0.0) return false;
      const double along = glm::dot(box.axis[i], direction);
      const double at = glm::dot(box.axis[i], from_m);
      if (std::abs(along) < 1e-13) {
        if (std::abs(at) > half_m) return false;
        continue;
      }
      const double a = (-half_m - at) / along;
      const double b = (half_m - at) / along;
      first = std::max(first, std::min(a, b));
      last = std::min(last, std::max(a, b));
    }
    return first <= last;
  };
  double too_small = -100.0;
  double large_enough = 2000.0;
  while (large_enough - too_small > 1e-10)
    (hits(0.5 * (too_small + large_enough)) ? large_enough : too_small) = 0.5 * (too_small + large_enough);
  return large_enough;
}

std::vector<Gap> nearest_gaps(const oracle::World& world, const StandingNearest& definition, WorldTime t) {
  Nearest point = definition.point;
  point.t = t;
  point.radius_m = std::numeric_limits<float>::infinity();
  NearestQueryOptions options;
  options.target =
      definition.target == StandingTarget::center ? NearestTarget::center : NearestTarget::bounds;
  options.k = 1000;
  const auto truth = oracle::nearest_brute_force(world, point, options);
  // Members are separated from the others by the distances of the last member and the first other one, and by
  // the radius.
  const double radius_m = static_cast<double>(definition.point.radius_m);
  const std::size_t k = definition.k;
  std::vector<Gap> gaps;
  for (std::size_t place = 0; place < truth.size(); ++place) {
    double gap_m = truth[place].distance_m - radius_m;
    if (place < k && truth.size() > k) gap_m = std::max(gap_m, truth[place].distance_m - truth[k].distance_m);
    if (place >= k) gap_m = std::max(gap_m, truth[place].distance_m - truth[k - 1].distance_m);
    gaps.push_back({truth[place].entity, gap_m});
  }
  return gaps;
}

std::vector<Gap> gaps_at(const oracle::World& world, const Definition& definition, WorldTime t) {
  std::vector<Gap> gaps;
  if (definition.nearest) return nearest_gaps(world, *definition.nearest, t);
  if (definition.region && definition.region->target == StandingTarget::bounds) {
    Region region = definition.region->region;
    region.t = t;
    for (const oracle::EntityGap& gap : oracle::gaps(world, region))
      gaps.push_back({gap.entity, gap.gap_m});
  } else {
    const std::uint32_t mask = definition.region ? definition.region->region.mask : definition.ray->ray.mask;
    for (const EntityState& state : world.entities()) {
      if (!state.row.geometry.valid() || (state.row.mask & mask) == 0) continue;
      const OrientedBox box = bounds_at(world, state, t);
      gaps.push_back({state.id, definition.region
                                    ? center_gap_m(world, definition.region->region, box.center_m, t)
                                    : ray_gap_m(world, definition.ray->ray, box, t)});
    }
  }
  std::erase_if(gaps, [&](const Gap& gap) { return gap.entity == definition.excluded(); });
  return gaps;
}

double gap_of(const oracle::World& world, const Definition& definition, EntityId entity, WorldTime t) {
  for (const Gap& gap : gaps_at(world, definition, t))
    if (gap.entity == entity) return gap.gap_m;
  return std::numeric_limits<double>::infinity();
}

// ---- random worlds

Motion random_motion(Dice& dice, std::int64_t now_ns) {
  Motion motion;
  motion.p_world_m = dice.vector(12.0);
  motion.q_world = dice.one_in(3) ? glm::dquat(1, 0, 0, 0) : dice.orientation();
  motion.v_world_mps = dice.one_in(5) ? glm::dvec3(0.0) : dice.vector(15.0);
  if (!dice.one_in(3)) motion.w_world_radps = dice.vector(dice.one_in(4) ? 20.0 : 2.0);
  motion.valid_from = at_ns(now_ns - static_cast<std::int64_t>(dice.below(200'000'000)));
  return motion;
}

EntityRow random_row(Dice& dice, std::int64_t now_ns) {
  EntityRow row;
  if (!dice.one_in(12)) row.geometry = GeometryId{dice.below(3)};
  row.scale = {dice.from(0.3, 3.0), dice.from(0.3, 3.0), dice.from(0.3, 3.0)};
  row.mask = dice.one_in(8) ? 2u : 3u;
  row.motion = random_motion(dice, now_ns);
  return row;
}

std::vector<Definition> random_queries(Dice& dice, std::span<const EntityId> carriers) {
  std::vector<Definition> all;
  const auto carried_by = [&](bool carried) { return carried ? carriers[dice.below(2)] : EntityId{}; };
  for (const bool carried : {false, true}) {
    for (const RegionShape shape : {RegionShape::box, RegionShape::sphere, RegionShape::frustum}) {
      for (int variant = 0; variant < 3; ++variant) {
        StandingRegion definition;
        definition.region.shape = shape;
        definition.region.test = variant == 1 ? RegionTest::inside : RegionTest::touching;
        definition.target = variant == 2 ? StandingTarget::center : StandingTarget::bounds;
        definition.region.center_m = glm::vec3(dice.vector(5.0));
        definition.region.half_extent_m = glm::vec3(dice.from(4, 12), dice.from(2, 9), dice.from(2, 9));
        definition.region.near_m = shape == RegionShape::frustum && dice.one_in(2) ? 1.5f : 0.0f;
        if (!dice.one_in(3)) definition.region.q = glm::quat(dice.orientation());
        definition.region.mask = dice.one_in(3) ? 1u : mask_all;
        definition.region.carrier = carried_by(carried);
        if (dice.one_in(2)) definition.excluded = carriers[0];
        all.emplace_back(definition);
      }
    }
    StandingRay ray;
    ray.ray.origin_m = glm::vec3(dice.vector(8.0));
    ray.ray.direction = glm::vec3(dice.vector(1.0) + glm::dvec3(0.0, 0.0, 0.2));
    ray.ray.lambda_min = dice.one_in(2) ? 0.5f : 0.0f;
    ray.ray.lambda_max = dice.one_in(2) ? 30.0f : 1e30f;
    ray.ray.carrier = carried_by(carried);
    all.emplace_back(ray);
    for (const StandingTarget target : {StandingTarget::bounds, StandingTarget::center}) {
      StandingNearest nearest;
      nearest.target = target;
      nearest.k = 1 + dice.below(5);
      nearest.point.point_m = glm::vec3(dice.vector(4.0));
      if (dice.one_in(2)) nearest.point.radius_m = 9.0f;
      nearest.point.carrier = carried_by(carried);
      if (carried) nearest.point.excluded = nearest.point.carrier;
      all.emplace_back(nearest);
    }
  }
  return all;
}

struct Watched {
  Definition definition;
  std::unique_ptr<StandingQuery> query;
  Members members;
  std::vector<StandingEvent> waiting;
};

struct Tally {
  std::size_t compared = 0, unsure = 0, crossings = 0, writes = 0;
};

std::unique_ptr<StandingQuery> watch(FollowedWorld& world, const Definition& definition) {
  if (definition.region) return world.watch(*definition.region);
  if (definition.ray) return world.watch(*definition.ray);
  return world.watch(*definition.nearest);
}

/// Entities that are certainly inside are members, and those that are certainly outside are not.
void compare(const oracle::World& world, const Watched& watched, WorldTime t, Tally& tally,
             const char* when) {
  for (const Gap& gap : gaps_at(world, watched.definition, t)) {
    if (std::abs(gap.gap_m) < certain_m) {
      ++tally.unsure;
      continue;
    }
    ++tally.compared;
    ASSERT_EQ(watched.members.holds(gap.entity), gap.gap_m < 0.0)
        << when << ", entity " << gap.entity.index << " at " << t.time_since_epoch().count() << " ns, gap "
        << gap.gap_m << " m";
  }
}

/// Compares the events of (from, to) with the rows of that time.
void judge_motion(const oracle::World& rows, Watched& watched, WorldTime from, WorldTime to, Tally& tally) {
  auto next = watched.waiting.begin();
  const auto take_until = [&](WorldTime t) {
    for (; next != watched.waiting.end() && next->cause == EventCause::motion && next->time <= t; ++next) {
      watched.members.take(*next);
      ++tally.crossings;
      const double gap_m = gap_of(rows, watched.definition, next->entity, next->time);
      EXPECT_LT(std::abs(gap_m), at_crossing_m) << "at a crossing";
      const double sign = next->kind == EventKind::enter ? 1.0 : -1.0;
      EXPECT_GT(sign * gap_of(rows, watched.definition, next->entity, next->time - around), -certain_m);
      EXPECT_LT(sign * gap_of(rows, watched.definition, next->entity, next->time + around), certain_m);
      EXPECT_GE(next->time, from);
      EXPECT_LT(next->time, to);
    }
  };
  const std::int64_t length_ns = (to - from).count();
  for (int k = 1; k < samples_between; ++k) {
    const WorldTime t = from + Nanoseconds(length_ns * k / samples_between);
    take_until(t);
    compare(rows, watched, t, tally, "between versions");
    if (testing::Test::HasFatalFailure()) return;
  }
  take_until(to);
  watched.waiting.erase(watched.waiting.begin(), next);
}

void write_at_random(FollowedWorld& world, Dice& dice, std::vector<EntityId>& alive, std::size_t kept,
                     std::int64_t now_ns) {
  std::vector<std::uint32_t> created;
  std::vector<EntityId> removed;
  world.execute(
      [&](Transaction& transaction) {
        for (auto count = 1 + dice.below(4); count > 0; --count) {
          const EntityId some = alive[dice.below(static_cast<std::uint32_t>(alive.size()))];
          const bool may_be_removed =
              alive.size() > kept + 4 &&
              std::ranges::find(alive, some) >= alive.begin() + static_cast<std::ptrdiff_t>(kept);
          switch (dice.below(6)) {
            case 0:
              created.push_back(transaction.create(random_row(dice, now_ns)));
              break;
            case 1:
              if (!may_be_removed) break;
              transaction.remove(some);
              removed.push_back(some);
              std::erase(alive, some);
              break;
            case 2:
              transaction.update(some, random_row(dice, now_ns));
              break;
            default:
              transaction.update_motion(some, random_motion(dice, now_ns));
          }
        }
        transaction.update_motion(alive[0], random_motion(dice, now_ns));
      },
      now_ns);
  for (const std::uint32_t ordinal : created)
    alive.push_back(world.created(ordinal));
}

void run_world(std::uint32_t seed, Tally& tally) {
  Dice dice(seed);
  FollowedWorld world;
  world.add(make_box({2.0, 1.0, 1.5}));
  world.add(make_sphere(1.0, 1));
  world.add(make_rectangle(3.0, 2.0));
  std::vector<EntityId> alive;
  alive.reserve(64);
  for (int k = 0; k < 20; ++k)
    alive.push_back(world.create(random_row(dice, 0), 0));
  constexpr std::size_t kept = 4;
  std::vector<Watched> all;
  for (const Definition& definition : random_queries(dice, std::span(alive).first(kept)))
    all.push_back({definition, watch(world, definition), {}, {}});
  std::int64_t now_ns = 0;
  for (int k = 0; k < versions; ++k) {
    const oracle::World rows = world.rows();
    const WorldTime from = rows.version_time();
    for (Watched& watched : all) {
      // The effects of the version's writes; crossings follow with the next version.
      for (const StandingEvent& event : events_of(world, *watched.query))
        watched.waiting.push_back(event);
      for (const StandingEvent& event : watched.waiting) {
        EXPECT_NE(event.cause, EventCause::motion);
        EXPECT_EQ(event.time, from);
        tally.writes += event.cause == EventCause::write ? 1 : 0;
        watched.members.take(event);
      }
      watched.waiting.clear();
      EXPECT_TRUE(watched.members.complete(*watched.query));
      ASSERT_NO_FATAL_FAILURE(compare(rows, watched, from, tally, "at a version")) << "seed " << seed;
    }
    now_ns += static_cast<std::int64_t>(dice.one_in(6) ? 0 : dice.below(120'000'000));
    write_at_random(world, dice, alive, kept, now_ns);
    for (std::size_t which = 0; which < all.size(); ++which) {
      Watched& watched = all[which];
      watched.waiting = events_of(world, *watched.query);
      SCOPED_TRACE("seed " + std::to_string(seed) + ", version " + std::to_string(k) + ", spec " +
                   std::to_string(which));
      ASSERT_NO_FATAL_FAILURE(judge_motion(rows, watched, from, at_ns(now_ns), tally));
    }
  }
}

TEST(RandomWorld, EventsAgreeWithTheOracle) {
  Tally tally;
  for (std::uint32_t seed = 1; seed <= worlds; ++seed) {
    run_world(seed, tally);
    if (HasFatalFailure()) break;
  }
  EXPECT_GT(tally.crossings, std::size_t{worlds} * 150);
  EXPECT_GT(tally.writes, std::size_t{worlds} * 500);
  EXPECT_LT(tally.unsure, tally.compared / 1000);
}

}  // namespace
}  // namespace rtstdb::standing::test
