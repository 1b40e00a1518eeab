// The rows of a free body: none of them differs from the motion by more than is permitted, and few are
// written.

#include "runtime/modules/free_body/body_row.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>

namespace hil::modules {
namespace {

using glm::dquat;
using glm::dvec3;

const RigidBody body({.mass_kg = 10.0,
                      .inertia_kgm2 = glm::dmat3(dvec3(1.0, 0.0, 0.0), dvec3(0.0, 2.0, 0.0),
                                                 dvec3(0.0, 0.0, 2.7))},
                     0.0);

struct Result {
  int rows = 0;
  RowError largest;  ///< of the row that readers have, at the begins and the middles of all steps
};

/// Steps a body with one integration step for each period, and writes its rows.
Result written_rows(RigidBodyState state, std::int64_t period_ns, int steps, const RowError& permitted,
                    const std::function<Wrench(int)>& wrench) {
  BodyRow row(permitted);
  Result result;
  rtstdb::Motion readers;
  for (int i = 0; i < steps; ++i) {
    const double dt_s = static_cast<double>(period_ns) * 1e-9;
    const BodyStep step{.begin = state,
                        .end = body.step(state, wrench(i), dt_s),
                        .begin_time = rtstdb::world_time_ns(i * period_ns),
                        .end_time = rtstdb::world_time_ns((i + 1) * period_ns)};
    if (const auto next = row.replacement(body, step)) {
      row.set_written(*next);
      readers = *next;
      ++result.rows;
    }
    const RigidBodyState middle = body.step(state, wrench(i), 0.5 * dt_s);
    for (const auto& [at, time] : {std::pair(step.begin, step.begin_time), std::pair(step.end, step.end_time),
                                   std::pair(middle, rtstdb::world_time_ns(i * period_ns + period_ns / 2))}) {
      const RowError error = error_of(readers, at, time);
      result.largest.position_m = std::max(result.largest.position_m, error.position_m);
      result.largest.angle_rad = std::max(result.largest.angle_rad, error.angle_rad);
    }
    state = step.end;
  }
  EXPECT_LE(row.largest_error().position_m, result.largest.position_m);
  return result;
}

constexpr std::int64_t ms = 1'000'000;
const RowError permitted{.position_m = 1e-3, .angle_rad = 1e-3};

TEST(RowError, IsTheDistanceAndTheAngleAtAnInstant) {
  // After 2 s the row is at (1, 4, 0), turned by 0.6 rad.
  const rtstdb::Motion row{
      .p_world_m = {1.0, 0.0, 0.0}, .v_world_mps = {0.0, 2.0, 0.0}, .w_world_radps = {0.0, 0.0, 0.3}};
  for (const double angle_rad : {0.0, 1e-4, 0.02, -0.5, 3.0}) {
    const dquat q = glm::angleAxis(0.6 + angle_rad, dvec3(0.0, 0.0, 1.0));
    for (const dquat& attitude : {q, -q}) {
      const RowError error =
          error_of(row, body.state({1.0, 7.0, 4.0}, {}, attitude, {}), rtstdb::world_time_ns(2'000 * ms));
      EXPECT_NEAR(error.position_m, 5.0, 1e-12);
      EXPECT_NEAR(error.angle_rad, std::abs(angle_rad), 1e-12);
    }
  }
}

TEST(BodyRow, BodyWithoutForceNeedsOneRow) {
  const RigidBodyState start =
      body.state({1e4, -2e4, 3e4}, {3.0, 2.0, -1.0}, dquat(1.0, 0.0, 0.0, 0.0), {0.0, 0.0, 1.0});
  const Result result = written_rows(start, ms, 100'000, permitted, [](int) { return Wrench{}; });
  EXPECT_EQ(result.rows, 1) << "it turns about a principal axis";
  EXPECT_LE(result.largest.position_m, permitted.position_m);
  EXPECT_LE(result.largest.angle_rad, permitted.angle_rad);
}

/// Under a constant acceleration a, a row written at t is wrong by a t^2 / 2: it lasts sqrt(2 e / a).
TEST(BodyRow, ConstantForceNeedsRowsAtARateThatFollowsFromTheError) {
  const RigidBodyState start = body.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), {});
  const Result result = written_rows(start, ms, 10'000, permitted, [](int) {
    return Wrench{.force_body_n = {2.0, 0.0, 0.0}};
  });
  const double lasts_s = std::sqrt(2.0 * permitted.position_m / 0.2);
  EXPECT_NEAR(result.rows, 10.0 / lasts_s, 0.03 * 10.0 / lasts_s);
  EXPECT_LE(result.largest.position_m, permitted.position_m);
}

TEST(BodyRow, ErrorsAreWithinTheirBoundsAtEveryStepOfATumblingBody) {
  const RigidBodyState start = body.state({}, {1.0, 0.0, 0.0}, dquat(1.0, 0.0, 0.0, 0.0), {0.3, 1.5, 0.1});
  const auto pulses = [](int step) {
    const bool on = step / 700 % 3 == 1;
    return Wrench{.force_body_n = {on ? 8.0 : 0.0, 0.0, 0.0},
                  .torque_body_nm = {0.0, on ? 0.3 : 0.0, step / 1100 % 2 == 0 ? 0.2 : -0.2}};
  };
  const Result result = written_rows(start, ms, 20'000, permitted, pulses);
  EXPECT_LE(result.largest.position_m, permitted.position_m);
  EXPECT_LE(result.largest.angle_rad, permitted.angle_rad);
  EXPECT_GT(result.largest.angle_rad, 0.9 * permitted.angle_rad) << "rows are written too often";
  EXPECT_LT(result.rows, 2'000);
  EXPECT_GT(result.rows, 20);
}

TEST(BodyRow, TinyBoundsAreKeptWithARowInEachStep) {
  const RigidBodyState start = body.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), {0.3, 1.5, 0.1});
  const RowError tiny{.position_m = 1e-9, .angle_rad = 3e-9};
  BodyRow row(tiny);
  RigidBodyState state = start;
  const Wrench wrench{.force_body_n = {5.0, 0.0, 0.0}, .torque_body_nm = {0.0, 0.5, 0.0}};
  for (int i = 0; i < 5'000; ++i) {
    const BodyStep step{.begin = state,
                        .end = body.step(state, wrench, 1e-3),
                        .begin_time = rtstdb::world_time_ns(i * ms),
                        .end_time = rtstdb::world_time_ns((i + 1) * ms)};
    const auto next = row.replacement(body, step);
    if (next) row.set_written(*next);
    ASSERT_TRUE(row.holds_at_end(step)) << "step " << i;
    state = step.end;
  }
  EXPECT_LE(row.largest_error().position_m, tiny.position_m);
  EXPECT_LE(row.largest_error().angle_rad, tiny.angle_rad);
}

TEST(BodyRow, RowOfUnknownStateIsWrittenAgain) {
  const RigidBodyState state = body.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), {});
  const BodyStep step{.begin = state, .end = state, .begin_time = {}, .end_time = rtstdb::world_time_ns(ms)};
  BodyRow row(permitted);
  const auto first = row.replacement(body, step);
  ASSERT_TRUE(first);
  row.set_written(*first);
  EXPECT_FALSE(row.replacement(body, step));
  row.forget();
  EXPECT_TRUE(row.replacement(body, step));
}

}  // namespace
}  // namespace hil::modules
