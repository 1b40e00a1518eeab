// First times of impact: closed forms, and random bodies against the oracle.

#include "shaders/shared/impact.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "tests/gpu/answer_bits.hpp"
#include "tests/gpu/random_queries.hpp"
#include "tests/support/concave_meshes.hpp"
#include "tests/support/hull_meshes.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

using namespace std::chrono_literals;

class ImpactTest : public DatabaseTest {
 protected:
  ImpactAnswer search(const ImpactSearch& one, ImpactQueryOptions options = {}) {
    options.name = "impacts";
    options.capacity = 1;
    const auto query = prepare(options);
    if (!query) return {};
    query->searches()[0] = one;
    const Outcome outcome = run(*query, 1);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    EXPECT_FALSE(query->answers()[0].incomplete);
    return query->answers()[0];
  }
  GeometryId cube() {
    if (!cube_.valid()) cube_ = add(make_box({1.0, 1.0, 1.0}));
    return cube_;
  }
  EntityId cube_at(const glm::dvec3& p_m, const glm::dvec3& v_mps = glm::dvec3(0.0),
                   const glm::dvec3& w_radps = glm::dvec3(0.0)) {
    EntityRow row = row_of(cube(), p_m);
    row.motion.v_world_mps = v_mps;
    row.motion.w_world_radps = w_radps;
    return create(row);
  }

 private:
  GeometryId cube_;
};

double seconds(Nanoseconds time) {
  return static_cast<double>(time.count()) * 1e-9;
}

TEST_F(ImpactTest, ACubeThatApproachesAnother) {
  const EntityId first = cube_at({-5.0, 0.2, 0.1}, {2.0, 0.0, 0.0});
  const EntityId second = cube_at({0.0, 0.0, 0.0});
  const ImpactAnswer found = search({.first = first, .second = second, .window = 10s, .tolerance_m = 0.01f});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  EXPECT_EQ(found.second, second);
  EXPECT_NEAR(seconds(found.after), 2.0 - 0.005 / 2.0, 0.005 / 2.0 + 1e-6);
  EXPECT_GT(found.distance_m, 0.0f);
  EXPECT_LE(found.distance_m, 0.01f);
  EXPECT_NEAR(found.n_world.x, -1.0f, 1e-3f);
  EXPECT_NEAR(found.v_relative_mps.x, 2.0f, 1e-5f);
  EXPECT_NEAR(found.p_first_m.x, 0.5f, 0.01f);
  EXPECT_EQ(search({.first = first, .second = second, .window = 1900ms}).status, ImpactStatus::none);
}

/// A thin plate and a bullet at 1 km/s, which passes a metre in a millisecond.
TEST_F(ImpactTest, NothingTunnels) {
  const EntityId plate = create(row_of(add(make_box({0.001, 2.0, 2.0}))));
  EntityRow bullet = row_of(add(make_box({0.02, 0.005, 0.005})), {-900.0, 0.3, 0.2});
  bullet.motion.v_world_mps = {1000.0, 0.0, 0.0};
  const EntityId first = create(bullet);
  const ImpactAnswer found = search({.first = first, .second = plate, .window = 2s, .tolerance_m = 0.001f});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  EXPECT_NEAR(seconds(found.after), (900.0 - 0.01 - 0.0005) / 1000.0, 2e-6);
  bullet.motion.p_world_m = {-900.0, 1.2, 0.2};
  EXPECT_EQ(search({.first = create(bullet), .second = plate, .window = 2s}).status, ImpactStatus::none);
}

/// A bar that turns about its middle meets a cube with its end.
TEST_F(ImpactTest, ABarThatTurns) {
  EntityRow bar = row_of(add(make_box({4.0, 0.1, 0.1})));
  bar.motion.w_world_radps = {0.0, 0.0, 1.0};
  const EntityId first = create(bar);
  const EntityId second = cube_at({0.0, 2.0, 0.0});
  const ImpactAnswer found = search({.first = first, .second = second, .window = 10s, .tolerance_m = 0.001f});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  // The upper side of the bar, y' = 0.05, meets the cube's corner (0.5, 1.5): 0.5 sin a - 1.5 cos a = -0.05.
  const double angle_rad = std::atan2(1.5, 0.5) - std::asin(0.05 / std::hypot(0.5, 1.5));
  EXPECT_NEAR(seconds(found.after), angle_rad, 0.002);
  const ImpactAnswer never =
      search({.first = first, .second = cube_at({0.0, 2.6, 0.0}), .window = 10s, .tolerance_m = 0.001f});
  EXPECT_EQ(never.status, ImpactStatus::none);
}

TEST_F(ImpactTest, TheFirstOfSeveralIsFound) {
  const EntityId first = cube_at({0.0, 0.0, 0.0}, {10.0, 0.0, 0.0});
  cube_at({9.0, 0.0, 0.0});
  const EntityId nearest = cube_at({5.0, 0.0, 0.0});
  cube_at({7.0, 0.0, 0.0});
  cube_at({3.0, 5.0, 0.0});
  const ImpactAnswer found = search({.first = first, .window = 2s});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  EXPECT_EQ(found.second, nearest);
  EXPECT_NEAR(seconds(found.after), 0.4, 1e-3);
  EXPECT_EQ(found.candidates, 3u);
  const ImpactAnswer cut = search({.first = first, .window = 2s}, {.candidates_per_search = 1});
  EXPECT_TRUE(cut.overflow);
}

TEST_F(ImpactTest, BodiesThatTouchAlready) {
  const EntityId first = cube_at({0.0, 0.0, 0.0}, {1.0, 0.0, 0.0});
  const EntityId second = cube_at({0.9, 0.0, 0.0});
  const ImpactAnswer found = search({.first = first, .second = second});
  EXPECT_EQ(found.status, ImpactStatus::impact);
  EXPECT_EQ(found.after.count(), 0);
  EXPECT_EQ(found.distance_m, 0.0f);
}

TEST_F(ImpactTest, ThePrecisionIsThatOfThePair) {
  const glm::dvec3 far_m(99'000.0, -98'000.0, 97'000.0);
  const EntityId first = cube_at(far_m, {100.0, 0.0, 0.0});
  const EntityId second = cube_at(far_m + glm::dvec3(301.0, 0.4, 0.0));
  const ImpactAnswer found = search({.first = first, .second = second, .window = 5s, .tolerance_m = 0.001f});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  EXPECT_NEAR(seconds(found.after), 3.0, 1.1e-5);
}

/// A square plate of no thickness in the plane x = 0, with a square hole.
TriangleMesh frame(float outer_m, float hole_m) {
  TriangleMesh mesh;
  for (const float half_m : {0.5f * outer_m, 0.5f * hole_m})
    for (const auto& [y, z] : {std::pair(-1.0f, -1.0f), {1.0f, -1.0f}, {1.0f, 1.0f}, {-1.0f, 1.0f}})
      mesh.positions_m.emplace_back(0.0f, y * half_m, z * half_m);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t next = (i + 1) % 4;
    mesh.triangles.emplace_back(i, next, 4 + next);
    mesh.triangles.emplace_back(i, 4 + next, 4 + i);
  }
  return mesh;
}

TEST_F(ImpactTest, SurfacesThatAreNotConvex) {
  const GeometryId holed = add(frame(10.0f, 4.0f));
  EXPECT_EQ(database().geometry_info(holed)->convex_parts, 0u);
  const EntityId plate = create(row_of(holed, {100.0, 0.0, 0.0}));
  // A cube flies through the hole, and another one meets the plate beside it.
  const EntityId through = cube_at({0.0, 1.4, 0.0}, {20.0, 0.0, 0.0});
  EXPECT_EQ(search({.first = through, .second = plate, .window = 10s}).status, ImpactStatus::none);
  const EntityId beside = cube_at({0.0, 1.6, 0.0}, {20.0, 0.0, 0.0});
  const ImpactAnswer found = search({.first = beside, .second = plate, .window = 10s, .tolerance_m = 0.01f});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  EXPECT_NEAR(seconds(found.after), 99.5 / 20.0, 0.01 / 20.0 + 1e-6);
  EXPECT_LE(found.distance_m, 0.01f);
  EXPECT_NEAR(found.n_world.x, -1.0f, 1e-3f);
  EXPECT_NEAR(found.p_first_m.x, 0.5f, 0.01f);
  EXPECT_NEAR(found.p_first_m.y, 0.45f, 0.06f);
  EXPECT_NEAR(found.v_relative_mps.x, 20.0f, 1e-4f);
}

TEST_F(ImpactTest, NothingTunnelsThroughASurface) {
  const GeometryId bullet = add(make_box({0.02, 0.005, 0.005}));
  const EntityId plate = create(row_of(add(frame(10.0f, 4.0f)), {500.0, 0.0, 0.0}));
  EntityRow fast = row_of(bullet, {0.0, 3.0, 0.0});
  fast.motion.v_world_mps = {1000.0, 0.0, 0.0};
  const EntityId at_plate = create(fast);
  const ImpactAnswer found = search({.first = at_plate, .second = plate, .window = 1s});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  EXPECT_NEAR(seconds(found.after), 0.49999, 1.1e-6);
  fast.motion.p_world_m.y = 1.9;
  EXPECT_EQ(search({.first = create(fast), .second = plate, .window = 1s}).status, ImpactStatus::none);
}

TEST_F(ImpactTest, SurfacesThatTurnAndSurfacesThatTouchAlready) {
  // A frame that turns about z meets a cube beside its plane; it stands upright after a quarter turn.
  EntityRow door = row_of(add(frame(4.0f, 1.0f)));
  door.motion.w_world_radps = {0.0, 0.0, 0.5};
  const EntityId turns = create(door);
  const EntityId block = cube_at({-1.5, 0.0, 0.0});
  const ImpactAnswer found = search({.first = turns, .second = block, .window = 10s});
  ASSERT_EQ(found.status, ImpactStatus::impact);
  // The upper half of the plane, at the angle a to y, meets the corner (-1, 0.5) where tan a is 2.
  EXPECT_NEAR(seconds(found.after), 2.0 * std::atan(2.0), 2e-3);
  const EntityId inside = cube_at({0.2, 1.0, 0.0});
  const ImpactAnswer at_once = search({.first = turns, .second = inside, .window = 1s});
  EXPECT_EQ(at_once.status, ImpactStatus::impact);
  EXPECT_EQ(at_once.after.count(), 0);
  EXPECT_EQ(at_once.distance_m, 0.0f);
}

TEST_F(ImpactTest, TheFirstOfConvexBodiesAndSurfaces) {
  const EntityId first = cube_at({0.0, 3.0, 0.0}, {10.0, 0.0, 0.0});
  const EntityId plate = create(row_of(add(frame(10.0f, 4.0f)), {50.0, 0.0, 0.0}));
  const EntityId block = cube_at({80.0, 3.0, 0.0});
  EXPECT_EQ(search({.first = first, .window = 10s}).second, plate);
  const EntityId nearer = cube_at({30.0, 3.0, 0.0});
  const ImpactAnswer found = search({.first = first, .window = 10s});
  EXPECT_EQ(found.second, nearer);
  EXPECT_EQ(found.candidates, 3u);
  EXPECT_EQ(search({.first = first, .second = block, .window = 10s}).second, block);
}

TEST_F(ImpactTest, BadInputIsRefused) {
  const EntityId first = cube_at({0.0, 0.0, 0.0});
  const auto query = prepare(ImpactQueryOptions{.name = "impacts", .capacity = 1});
  const auto refusal = [&](const ImpactSearch& one) {
    query->searches()[0] = one;
    const Outcome outcome = run(*query, 1);
    EXPECT_FALSE(outcome.done());
    return describe(outcome.bad_input);
  };
  EXPECT_NE(refusal({.first = first, .window = -1ns}).find("window is -1e-09 s; it must be 0 to 10 s"),
            std::string::npos);
  EXPECT_NE(refusal({.first = first, .window = 11s}).find("window is 11 s;"), std::string::npos);
  EXPECT_NE(refusal({.first = first, .tolerance_m = 0.0f}).find("tolerance_m is 0"), std::string::npos);
  EXPECT_NE(refusal({.first = first, .second = first}).find("meet itself"), std::string::npos);
  EXPECT_EQ(refusal({}), "unknown_entity: it names no entity");
  for (const double limit_m : {min_impact_tolerance_m, max_contact_margin_m}) {
    query->searches()[0] = {.first = first, .tolerance_m = static_cast<float>(limit_m)};
    EXPECT_TRUE(run(*query, 1).done()) << limit_m << " m is allowed";
  }
  const auto prepared = database().prepare(ImpactQueryOptions{.name = "impacts", .capacity = 0});
  ASSERT_FALSE(prepared.ok());
  EXPECT_NE(prepared.error().message.find("0 searches"), std::string::npos);
}

/// A gear that turns fast beside another body, near it all the time, needs a step for each millionth of a
/// turn.
TEST_F(ImpactTest, AnUndecidedAnswerHasAReason) {
  const GeometryId gear = add(make_gear(1.0, 0.9, 0.4, 0.3, 12));
  EntityRow row = row_of(gear);
  row.motion.w_world_radps = {0.0, 0.0, 1000.0};
  const EntityId turns = create(row);
  for (const GeometryId beside : {gear, cube()}) {
    EntityRow still = row_of(beside, {beside == gear ? 2.01 : 1.51, 0.0, 0.0});
    const ImpactAnswer found =
        search({.first = turns, .second = create(still), .window = 10s, .tolerance_m = 0.002f});
    EXPECT_EQ(found.status, ImpactStatus::undecided);
    EXPECT_EQ(found.reason, UndecidedReason::steps) << to_string(found.reason);
    EXPECT_TRUE(found.second.valid());
    EXPECT_GT(found.after.count(), 0);
  }
  const auto fingers =
      database().add_geometry(make_fingers(3, 0.2, 1.0, 0.5, 8), "fingers",
                              {.convex_parts_m = pieces_of(make_fingers(3, 0.2, 1.0, 0.5, 8))});
  ASSERT_TRUE(fingers.ok()) << fingers.error().message;
  const EntityId parts = create(row_of(fingers.value(), {20.0, 0.0, 0.0}));
  const ImpactAnswer unsearched = search({.first = turns, .second = parts});
  EXPECT_EQ(unsearched.reason, UndecidedReason::none);  // a pair of surfaces
  const EntityId block = cube_at({22.0, 0.0, 0.0});
  const ImpactAnswer cut = search({.first = parts, .second = block}, {.candidates_per_search = 2});
  EXPECT_TRUE(cut.overflow);
  EXPECT_EQ(cut.status, ImpactStatus::undecided);
  EXPECT_EQ(cut.reason, UndecidedReason::capacity) << to_string(cut.reason);
  EXPECT_FALSE(cut.second.valid());
}

/// Steps that pause many times, more pairs than slots for paused searches, chunks that end as soon as they
/// can, another order, and searches by themselves.
TEST_F(ImpactTest, AnswersDoNotDependOnWhereSearchesPause) {
  constexpr std::uint32_t pairs = 1'300;
  static_assert(pairs > shared::max_surface_slots);
  std::vector<std::vector<Words>> answers;
  for (const Nanoseconds chunk : {0ns, 1ns}) {
    open({.max_entities = 2 * pairs, .chunk = chunk});
    Random random(61);
    const GeometryId meshes[] = {add(make_torus(1.0, 0.3, 40)), add(make_wavy_sheet(2.0, 0.3, 40)),
                                 add(make_gear(1.0, 0.8, 0.4, 0.3, 12))};
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < pairs; ++i) {
      for (const bool is_first : {true, false}) {
        EntityRow& row = rows.emplace_back(row_of(meshes[random.below(std::size(meshes))]));
        // Some are linked or lie side by side, and drift.
        row.motion.p_world_m = is_first ? glm::dvec3(0.0) : random.uniform(0.5, 2.2) * random.direction();
        row.motion.v_world_mps = random.magnitude(0.01, 2.0) * random.direction();
        row.motion.q_world = random.orientation();
        row.motion.w_world_radps = random.magnitude(0.01, 1.0) * random.direction();
      }
    }
    const std::vector<EntityId> bodies = create(rows);
    const auto query =
        prepare(ImpactQueryOptions{.name = "divided", .capacity = pairs, .candidates_per_search = 1});
    ASSERT_NE(query, nullptr);
    const auto run_in_order = [&](const std::vector<std::uint32_t>& order) {
      for (std::uint32_t place = 0; place < order.size(); ++place)
        query->searches()[place] = {.first = bodies[2 * order[place]],
                                    .second = bodies[2 * order[place] + 1],
                                    .window = 2s,
                                    .tolerance_m = 0.002f};
      const Outcome outcome = run(*query, order.size());
      EXPECT_TRUE(outcome.done()) << describe(outcome);
      return words_of(query->answers());
    };
    std::vector<std::uint32_t> order(pairs);
    std::iota(order.begin(), order.end(), 0u);
    answers.push_back(run_in_order(order));
    std::ranges::reverse(order);
    std::vector<Words> reversed = run_in_order(order);
    std::ranges::reverse(reversed);
    answers.push_back(std::move(reversed));
    for (std::uint32_t i = 0; i < pairs; i += 100)
      EXPECT_EQ(run_in_order({i})[0], answers[0][i]) << "search " << i << " by itself";
  }
  for (const std::vector<Words>& others : answers)
    EXPECT_TRUE(others == answers[0]);
  const auto impacts = std::ranges::count_if(answers[0], [](const Words& words) {
    return words[0] == static_cast<std::uint32_t>(ImpactStatus::impact);
  });
  EXPECT_GT(impacts, pairs / 4);
  EXPECT_LT(impacts, pairs);
}

class RandomImpacts : public RandomQueries {};

TEST_F(RandomImpacts, AgreeWithTheOracleInMixedWorlds) {
  fill({4, 60, 4.0});
  const Tally tally = run_random(ImpactQueryOptions{.name = "impacts", .candidates_per_search = 256}, 300);
  EXPECT_GT(tally.hits, tally.elements / 40);
  EXPECT_LE(tally.too_close, tally.elements / 20);
}

/// Pairs of hulls that approach one another and turn; most of them meet.
TEST_F(RandomImpacts, AgreeWithTheOracleForHulls) {
  constexpr std::uint32_t pairs = 300;
  const std::uint64_t batches = hil::tests::rounds(1, 50);
  Tally tally;
  for (std::uint64_t round = 0; round < batches && !HasFailure(); ++round) {
    open({.max_entities = 2 * pairs});
    Random random(17 + round);
    std::vector<GeometryId> hulls;
    for (std::uint64_t i = 0; i < 20; ++i)
      hulls.push_back(add(make_random_hull(100 * round + i, 8 + static_cast<std::uint32_t>(random.below(16)),
                                           {0.3 + 0.7 * random.uniform(0.0, 1.0), 0.6, 0.9})));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < pairs; ++i) {
      const glm::dvec3 p_m(100u * glm::uvec3(i % 20, i / 20, 0));
      const glm::dvec3 side = random.direction();
      EntityRow first = row_of(hulls[random.below(hulls.size())], p_m);
      EntityRow second = row_of(hulls[random.below(hulls.size())], p_m + random.magnitude(3.0, 30.0) * side);
      second.motion.v_world_mps =
          -random.magnitude(1.0, 100.0) * glm::normalize(side + 0.04 * random.vector());
      for (EntityRow* row : {&first, &second}) {
        row->motion.q_world = random.orientation();
        row->motion.w_world_radps = random.magnitude(0.01, 10.0) * random.direction();
      }
      rows.insert(rows.end(), {first, second});
    }
    const std::vector<EntityId> bodies = create(rows);
    const ImpactQueryOptions options{.name = "hulls", .capacity = pairs, .candidates_per_search = 1};
    const auto query = prepare(options);
    ASSERT_NE(query, nullptr);
    for (std::uint32_t i = 0; i < pairs; ++i)
      query->searches()[i] = {.first = bodies[2 * i],
                              .second = bodies[2 * i + 1],
                              .window = 10s,
                              .tolerance_m = static_cast<float>(random.magnitude(0.002, 0.05))};
    const std::vector<ImpactSearch> searches(query->searches().begin(), query->searches().end());
    const Outcome outcome = run(*query, pairs);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    tally += judge(world(), searches, query->answers(), options);
  }
  EXPECT_GT(tally.hits, tally.elements / 5);
  EXPECT_LE(tally.too_close, tally.elements / 50);
}

}  // namespace
}  // namespace rtstdb::test
