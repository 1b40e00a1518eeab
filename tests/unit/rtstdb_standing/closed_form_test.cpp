// Crossings whose instants have a closed form.

#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "followed_world.hpp"

namespace rtstdb::standing::test {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
/// Default tolerance of the instants.
constexpr double tolerance_ns = 3.0;

StandingRegion box_region(const glm::vec3& center_m, const glm::vec3& half_m,
                          StandingTarget target = StandingTarget::bounds) {
  StandingRegion definition;
  definition.region.center_m = center_m;
  definition.region.half_extent_m = half_m;
  definition.target = target;
  return definition;
}

struct ExpectedEvent {
  EventKind kind;
  EntityId entity;
  double at_s;
};

/// The events with EventCause::motion up to `until_ns`.
void expect_motions(FollowedWorld& world, StandingQuery& query, std::int64_t until_ns,
                    const std::vector<ExpectedEvent>& expected, double within_ns = tolerance_ns) {
  world.pass(until_ns);
  std::vector<StandingEvent> events;
  Version begun = 0;
  for (const StandingEvent& event : events_of(world, query)) {
    if (event.cause == EventCause::motion) events.push_back(event);
    if (event.kind == EventKind::reset) begun = event.version;
  }
  ASSERT_EQ(events.size(), expected.size());
  for (std::size_t k = 0; k < events.size(); ++k) {
    EXPECT_EQ(events[k].kind, expected[k].kind) << k;
    EXPECT_EQ(events[k].entity, expected[k].entity) << k;
    EXPECT_NEAR(static_cast<double>(events[k].time.time_since_epoch().count()), expected[k].at_s * 1e9,
                within_ns)
        << k;
    EXPECT_GT(events[k].version, begun) << k;
  }
}

using enum EventKind;

TEST(ClosedForm, BoxCrossesABox) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const auto one = world.create(row_of(cube, {-10.0, 0.2, 0.0}, {4.0, 0.0, 0.0}), 0);
  const auto touching = world.watch(box_region({0.0f, 0.0f, 0.0f}, {2.0f, 1.0f, 1.0f}));
  auto inside_definition = box_region({0.0f, 0.0f, 0.0f}, {2.0f, 1.0f, 1.0f});
  inside_definition.region.test = RegionTest::inside;
  const auto inside = world.watch(inside_definition);
  const auto center = world.watch(box_region({0.0f, 0.0f, 0.0f}, {2.0f, 1.0f, 1.0f}, StandingTarget::center));
  expect_motions(world, *touching, 9 * second_ns, {{enter, one, 7.5 / 4.0}, {exit, one, 12.5 / 4.0}});
  expect_motions(world, *inside, 9 * second_ns, {{enter, one, 8.5 / 4.0}, {exit, one, 11.5 / 4.0}});
  expect_motions(world, *center, 9 * second_ns, {{enter, one, 8.0 / 4.0}, {exit, one, 12.0 / 4.0}});
}

/// The tip of a rotating arm crosses a plane at asin(height / reach).
TEST(ClosedForm, RotatingArmEntersASlab) {
  FollowedWorld world;
  const auto arm = world.add(make_box({8.0, 0.01, 0.01}));
  EntityRow row = row_of(arm);
  row.motion.w_world_radps = {0.0, 0.0, 0.5};
  const auto one = world.create(row, 0);
  const auto query = world.watch(box_region({0.0f, 6.0f, 0.0f}, {100.0f, 3.0f, 100.0f}));
  // The leading corner is at (4, 0.005): y = 4 sin a + 0.005 cos a reaches 3.
  const double reach_m = std::hypot(4.0, 0.005);
  const double ahead = std::atan2(0.005, 4.0);
  const double enters_s = (std::asin(3.0 / reach_m) - ahead) / 0.5;
  const double half_turn_s = std::numbers::pi / 0.5;
  // It is symmetric about the vertical, and repeats every half turn.
  const double exits_s = half_turn_s - enters_s;
  expect_motions(world, *query, 13 * second_ns,
                 {{enter, one, enters_s},
                  {exit, one, exits_s},
                  {enter, one, enters_s + half_turn_s},
                  {exit, one, exits_s + half_turn_s}});
}

/// A frustum that rotates with its carrier, as a radar does: a centre enters when its bearing is half the
/// opening angle away.
TEST(ClosedForm, RotatingFrustumPassesACentre) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const auto one = world.create(row_of(cube, {0.0, 50.0, 0.0}), 0);
  EntityRow mast;
  mast.motion.p_world_m = {0.0, 0.0, 0.0};
  mast.motion.w_world_radps = {0.0, 0.0, 1.0};
  const auto carrier = world.create(mast, 0);
  StandingRegion definition =
      box_region({}, {100.0f, 100.0f * std::tan(0.25f), 20.0f}, StandingTarget::center);
  definition.region.shape = RegionShape::frustum;
  definition.region.carrier = carrier;
  definition.region.near_m = 1.0f;
  const auto query = world.watch(definition);
  const double half_rad = std::atan(static_cast<double>(definition.region.half_extent_m.y) / 100.0);
  const double faces_it_s = std::numbers::pi / 2.0;
  expect_motions(world, *query, 7 * second_ns,
                 {{enter, one, faces_it_s - half_rad}, {exit, one, faces_it_s + half_rad}});
}

TEST(ClosedForm, LightBarrierIsInterrupted) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 2.0, 1.0}));
  const auto first = world.create(row_of(cube, {5.0, -10.0, 0.0}, {0.0, 3.0, 0.0}), 0);
  const auto beyond_the_end = world.create(row_of(cube, {50.0, -10.0, 0.0}, {0.0, 3.0, 0.0}), 0);
  StandingRay definition;
  definition.ray.lambda_max = 40.0f;
  const auto barrier = world.watch(definition);
  definition.ray.lambda_max = std::numeric_limits<float>::infinity();
  const auto endless = world.watch(definition);
  expect_motions(world, *barrier, 9 * second_ns, {{enter, first, 3.0}, {exit, first, 11.0 / 3.0}});
  expect_motions(world, *endless, 9 * second_ns,
                 {{enter, first, 3.0},
                  {enter, beyond_the_end, 3.0},
                  {exit, first, 11.0 / 3.0},
                  {exit, beyond_the_end, 11.0 / 3.0}});
}

/// Two centres on lines through the point at different speeds: the order changes when the distances are
/// equal.
TEST(ClosedForm, NearestChanges) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const auto leaves = world.create(row_of(cube, {2.0, 0.0, 0.0}, {3.0, 0.0, 0.0}), 0);
  const auto approaches = world.create(row_of(cube, {0.0, 20.0, 0.0}, {0.0, -1.0, 0.0}), 0);
  StandingNearest definition;
  definition.target = StandingTarget::center;
  const auto center = world.watch(definition);
  definition.target = StandingTarget::bounds;
  const auto bounds = world.watch(definition);
  definition.point.radius_m = 10.0f;
  const auto near = world.watch(definition);
  // 2 + 3 t = 20 - t; also for the bounds, which are half a metre nearer on both lines.
  expect_motions(world, *center, 9 * second_ns, {{exit, leaves, 4.5}, {enter, approaches, 4.5}});
  expect_motions(world, *bounds, 9 * second_ns, {{exit, leaves, 4.5}, {enter, approaches, 4.5}});
  expect_motions(world, *near, 12 * second_ns, {{exit, leaves, 8.5 / 3.0}, {enter, approaches, 9.5}});
}

/// Contacts of a microsecond, or 0.1 mm deep, are found between versions that are seconds apart.
TEST(ClosedForm, BriefContactsAreFound) {
  FollowedWorld world;
  const auto cube = world.add(make_box({0.1, 0.1, 0.1}));
  const auto fast = world.create(row_of(cube, {-50'000.0, 0.0, 0.0}, {100'000.0, 0.0, 0.0}), 0);
  const auto thin = world.watch(box_region({}, {1e-6f, 1.0f, 1.0f}, StandingTarget::center));
  const double depth_s = static_cast<double>(1e-6f) / 1e5;
  expect_motions(world, *thin, second_ns, {{enter, fast, 0.5 - depth_s}, {exit, fast, 0.5 + depth_s}});

  FollowedWorld other;
  const auto large_cube = other.add(make_box({2.0, 2.0, 2.0}));
  // A centre passes the middle of a ball of 1 m at a distance of 0.9999 m.
  const auto one = other.create(row_of(large_cube, {-100.0, 0.9999, 0.0}, {30.0, 0.0, 0.0}), 0);
  StandingRegion ball = box_region({}, {1.0f, 0.0f, 0.0f}, StandingTarget::center);
  ball.region.shape = RegionShape::sphere;
  const auto query = other.watch(ball);
  const double along_m = std::sqrt(1.0 - 0.9999 * 0.9999);
  expect_motions(other, *query, 9 * second_ns,
                 {{enter, one, (100.0 - along_m) / 30.0}, {exit, one, (100.0 + along_m) / 30.0}}, 10.0);
}

/// An entity that passes at a distance of a micrometre has no event.
TEST(ClosedForm, NearMissesHaveNoEvent) {
  FollowedWorld world;
  const auto cube = world.add(make_box({2.0, 2.0, 2.0}));
  EntityRow row = row_of(cube, {-100.0, 2.000001, 0.0}, {30.0, 0.0, 0.0});
  row.motion.w_world_radps = {0.0, 1.0, 0.0};  // rotates on the passing face
  world.create(row, 0);
  const auto query = world.watch(box_region({}, {5.0f, 1.0f, 5.0f}));
  expect_motions(world, *query, 9 * second_ns, {});
  EXPECT_LT(world.follower().counts().examinations, 200u);
}

/// An entity that moves and rotates on the border is inside, and needs few examinations.
TEST(ClosedForm, EntityOnTheBorderIsInside) {
  FollowedWorld world;
  const auto car = world.add(make_box({4.0, 2.0, 1.5}));
  EntityRow row = row_of(car, {0.0, 0.0, 0.75}, {20.0, 0.0, 0.0});
  row.motion.w_world_radps = {0.0, 0.0, 0.3};
  world.create(row, 0);
  // The floor of the region is the ground at z = 0.
  StandingRegion definition = box_region({100.0f, 0.0f, 5.0f}, {50.0f, 50.0f, 5.0f});
  definition.region.test = RegionTest::inside;
  const auto inside = world.watch(definition);
  world.pass(20 * second_ns);
  const auto events = events_of(world, *inside);
  ASSERT_EQ(events.size(), 4u);  // reset, complete, enter, exit
  EXPECT_EQ(events[2].kind, enter);
  EXPECT_EQ(events[3].kind, exit);
  // The rear corners enter last, the front ones exit first: at rotation angles of 0.78 and 2.2.
  EXPECT_NEAR(static_cast<double>(events[2].time.time_since_epoch().count()), 52.1e9 / 20.0, 1e7);
  EXPECT_NEAR(static_cast<double>(events[3].time.time_since_epoch().count()), 148e9 / 20.0, 1e7);
  EXPECT_LT(world.follower().counts().examinations, 50u);
}

TEST(ClosedForm, FarFromTheOriginAfterADay) {
  FollowedWorld world;
  const auto cube = world.add(make_box({1.0, 1.0, 1.0}));
  const std::int64_t day_ns = 86'400 * second_ns;
  EntityRow row = row_of(cube, {90'000.0, -90'000.0, 0.0}, {0.0, 1.0, 0.0});
  row.motion.valid_from = at_ns(day_ns);
  const auto one = world.create(row, day_ns);
  const auto query = world.watch(box_region({90'000.0f, -89'990.0f, 0.0f}, {1.0f, 1.0f, 1.0f}));
  // At 1 m/s and 1e5 m from the origin, a position is accurate to some 1e-11 m.
  expect_motions(world, *query, day_ns + 20 * second_ns,
                 {{enter, one, 86'400.0 + 8.5}, {exit, one, 86'400.0 + 11.5}}, 40.0);
}

}  // namespace
}  // namespace rtstdb::standing::test
