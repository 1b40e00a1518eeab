// The rigid_bodies module and the database: when rows are written, what readers of them see, and that a run
// repeats bit for bit.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/gpu/runtime/rigid_bodies_fixture.hpp"

namespace hil::modules {
namespace {

using namespace test;

constexpr std::int64_t ms = 1'000'000;
constexpr double gravity_mps2 = 9.80665;
const char* const ball_and_floor =
    "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 20 cm}}}], stiffness: 20 "
    "kN/m, damping: 100 N s/m";

class RigidBodiesRows : public RigidBodiesFixture {
 protected:
  rtstdb::Motion row_of(const std::string& name) const {
    const auto states = database_->snapshot({});
    for (const rtstdb::EntityState& state : states.value())
      if (state.id == world_->find(name)) return state.row.motion;
    throw std::runtime_error("no row of " + name);
  }
  /// The outputs of three boxes that fall on one another and tumble.
  std::vector<double> tumble() {
    add_floor();
    for (int i = 0; i < 3; ++i) {
      add("box_" + std::to_string(i), rtstdb::make_box({0.5, 0.4, 0.3}),
          {.p_world_m = {0.1 * i, 0.05 * i, 0.4 + 0.5 * i}, .w_world_radps = {1.0, 2.0, 0.5 * i}});
    }
    const std::string solid = ", mass: 5 kg, inertia: {box: [0.5 m, 0.4 m, 0.3 m]}}";
    const auto module = rigid_bodies("{bodies: [{body: floor}, {body: box_0" + solid + ", {body: box_1" +
                                         solid + ", {body: box_2" + solid +
                                         "], stiffness: 200 kN/m, damping: 200 N s/m, substeps: 5}",
                                     5 * ms);
    allocation_guard::reset();
    std::vector<double> outputs = run_to(*module, 1.0);
    EXPECT_EQ(allocation_guard::seen().total(), 0U) << "in the steps";
    EXPECT_GE(outputs[touched], 3.0);
    return outputs;
  }
};

/// Far from contacts a row is written when it no longer describes the fall; near them in each step.
TEST_F(RigidBodiesRows, AreWrittenInEachStepNearContactsOnly) {
  add_floor();
  add("ball", rtstdb::make_sphere(0.2), {.p_world_m = {0.0, 0.0, 1.4}});
  const auto module =
      rigid_bodies(std::string(ball_and_floor) + ", margin: 10 mm, position_error: 1 mm}", 1 * ms);
  const double near_floor_s = std::sqrt(2.0 * 1.18 / gravity_mps2);
  std::vector<double> outputs = run_to(*module, near_floor_s);
  const double steps = std::floor(near_floor_s * 1e3);
  EXPECT_GT(outputs[rows], 0.02 * steps);
  EXPECT_LT(outputs[rows], 0.2 * steps);
  EXPECT_EQ(outputs[contacts], 0.0);
  outputs = run_to(*module, 3.0);
  const double rows_at_rest = outputs[rows];
  EXPECT_GT(outputs[contacts], 0.0);
  EXPECT_EQ(run_to(*module, 3.1)[rows] - rows_at_rest, 100.0);
}

TEST_F(RigidBodiesRows, AreWhereTheBodyIsAtEachStep) {
  add_floor();
  add("ball", rtstdb::make_sphere(0.2), {.p_world_m = {0.0, 0.0, 0.25}, .v_world_mps = {1.0, 0.0, 0.0}});
  const auto module = rigid_bodies(std::string(ball_and_floor) + ", position_error: 0.1 mm}", 2 * ms);
  for (double time_s = 0.0; time_s < 0.5; time_s += 0.01) {
    const std::vector<double> outputs = run_to(*module, time_s);
    const rtstdb::Pose pose = rtstdb::pose_at(row_of("ball"), rtstdb::world_time_ns(next_ns_ - period_ns_));
    ASSERT_LE(
        glm::distance(pose.p_world_m, glm::dvec3(of(outputs, 0, x), of(outputs, 0, y), of(outputs, 0, z))),
        1e-4)
        << time_s;
  }
}

TEST_F(RigidBodiesRows, ARunRepeatsBitForBit) {
  const std::vector<double> first = tumble();
  world_.reset();
  database_.reset();
  SetUp();
  next_ns_ = 0;
  const std::vector<double> second = tumble();
  ASSERT_EQ(first.size(), second.size());
  EXPECT_EQ(std::memcmp(first.data(), second.data(), sizeof(double) * first.size()), 0);
}

/// After skipped releases the bodies have moved on as they were, and their rows follow.
TEST_F(RigidBodiesRows, SkippedReleasesAreIntegrated) {
  add_floor();
  add("ball", rtstdb::make_sphere(0.2), {.p_world_m = {0.0, 0.0, 2.0}, .v_world_mps = {0.5, 0.0, 0.0}});
  const auto module = rigid_bodies(std::string(ball_and_floor) + "}", 1 * ms);
  run_to(*module, 0.1);
  next_ns_ += 100 * ms;
  const std::vector<double> outputs = run_to(*module, 0.3);
  EXPECT_NEAR(of(outputs, 0, x), 0.15, 1e-12);
  // The semi-implicit method falls by half a substep's speed more.
  EXPECT_NEAR(of(outputs, 0, z), 2.0 - 0.5 * gravity_mps2 * 0.09, gravity_mps2 * 0.3 * 0.25e-3);
  EXPECT_NEAR(row_of("ball").p_world_m.x, 0.15, 1e-4);
}

TEST_F(RigidBodiesRows, AHeldBodyRests) {
  add_floor();
  add("ball", rtstdb::make_sphere(0.2), {.p_world_m = {0.0, 0.0, 2.0}, .w_world_radps = {0.0, 0.0, 1.0}});
  const auto module = rigid_bodies(std::string(ball_and_floor) + "}", 1 * ms);
  inputs_[6] = {.value = 1.0, .time_ns = 0, .fresh = true};
  EXPECT_EQ(of(run_to(*module, 0.2), 0, z), 2.0);
  EXPECT_TRUE(has_event("ball is held"));
  inputs_[6].value = 0.0;
  inputs_[0] = {.value = 3.0, .time_ns = 0, .fresh = true};
  const std::vector<double> outputs = run_to(*module, 0.4);
  EXPECT_LT(of(outputs, 0, z), 1.9);
  // The force acts along the axes of the body, which no longer turns.
  EXPECT_NEAR(std::hypot(of(outputs, 0, vx), of(outputs, 0, vy)), 0.6, 0.005);
}

/// Faster than the margin in a step: the contact is not seen in time, which the run says.
TEST_F(RigidBodiesRows, AContactBeyondTheMarginIsReported) {
  add_floor();
  add("ball", rtstdb::make_sphere(0.2), {.p_world_m = {0.0, 0.0, 0.25}, .v_world_mps = {0.0, 0.0, -6.0}});
  const auto module = rigid_bodies(std::string(ball_and_floor) + ", margin: 1 mm}", 1 * ms);
  const std::vector<double> outputs = run_to(*module, 0.1);
  EXPECT_EQ(outputs[late], 1.0);
  EXPECT_TRUE(has_event("was not near in the step before; use a faster task or a larger margin"));
}

/// One pair is listed of two: the others pass through each other, and an expectation can fail on it.
TEST_F(RigidBodiesRows, MorePairsThanAreListedAreReported) {
  add_floor();
  add("ball", rtstdb::make_sphere(0.2), {.p_world_m = {0.0, 0.0, 0.199}});
  add("other", rtstdb::make_sphere(0.2), {.p_world_m = {1.0, 0.0, 0.199}});
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 20 cm}}}, {body: other, "
      "mass: 1 kg, inertia: {sphere: {radius: 20 cm}}}], stiffness: 20 kN/m, damping: 20 N s/m, max_pairs: "
      "1}",
      1 * ms);
  EXPECT_EQ(run_to(*module, 0.0095)[overflows], 10.0);
  EXPECT_TRUE(has_event("2 pairs are near each other, and the 1 of 'max_pairs'"));
}

TEST_F(RigidBodiesRows, AnOpenShapeIsRefusedWithItsPlace) {
  add_floor();
  add("ball", rtstdb::make_rectangle(1.0, 1.0), {.p_world_m = {0.0, 0.0, 2.0}});
  try {
    rigid_bodies(std::string(ball_and_floor) + "}", 1 * ms);
    FAIL() << "accepted";
  } catch (const SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("test:1:33: 'ball' has an open shape"), std::string::npos)
        << error.what();
  }
}

TEST_F(RigidBodiesRows, ABodyThatLeavesTheWorldStops) {
  add("ball", rtstdb::make_sphere(0.2), {.v_world_mps = {0.0, 0.0, -99'999.0}});
  const auto module = rigid_bodies(
      "{bodies: [{body: ball, mass: 1 kg, inertia: {sphere: {radius: 20 cm}}}], stiffness: 1 kN/m, damping: "
      "1 "
      "N s/m}",
      10 * ms);
  const std::vector<double> outputs = run_to(*module, 0.2);
  EXPECT_EQ(outputs[8], 1.0);
  EXPECT_EQ(of(outputs, 0, vz), 0.0);
  EXPECT_TRUE(has_event("ball stops and rests from now on"));
}

}  // namespace
}  // namespace hil::modules
