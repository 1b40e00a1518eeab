// A free body in a world: readers of its row find it where the body is, within the permitted errors.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "runtime/modules/free_body/body_row.hpp"
#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::size_t rows_output = 13;

class FreeBodyModule : public test::ModuleFixture {
 protected:
  FreeBodyModule() : ModuleFixture({"body"}) {}

  void SetUp() override {
    ModuleFixture::SetUp();
    rtstdb::EntityRow row;
    row.geometry = world_->add_geometry(rtstdb::make_box({2.0, 1.0, 1.0}), "box");
    row.motion.p_world_m = {3.0, 0.0, 0.0};
    row.motion.v_world_mps = {0.0, 1.0, 0.0};
    row.motion.w_world_radps = {0.1, 0.8, 0.05};
    capsule_ = world_->create("capsule", row);
  }

  std::unique_ptr<AnyModule> make(const std::string& more = "", std::int64_t period_ns = ms) {
    return ModuleFixture::make(
        *find_module_type("free_body"),
        "{body: capsule, mass: 10 kg, inertia: [1 kg m2, 2 kg m2, 2.7 kg m2]" + more + "}",
        {.instance = "capsule_motion", .period_ns = period_ns, .deadline_ns = period_ns});
  }

  static std::array<signals::SignalValue, 7> inputs(double force_x, double torque_z, double hold = 0.0) {
    std::array<signals::SignalValue, 7> values;
    for (signals::SignalValue& value : values)
      value = {.value = 0.0, .time_ns = 0, .fresh = true};
    values[0].value = force_x;
    values[5].value = torque_z;
    values[6].value = hold;
    return values;
  }

  rtstdb::Motion row() const {
    const auto states = database_->snapshot({});
    if (!states) throw std::runtime_error(states.error().message);
    for (const rtstdb::EntityState& state : states.value()) {
      if (state.id == capsule_) return state.row.motion;
    }
    throw std::runtime_error("the capsule is gone");
  }

  /// How far the row is from the outputs of a step at its time.
  RowError error_of_row(const std::vector<double>& outputs, std::int64_t time_ns) const {
    RigidBodyState state;
    state.p_world_m = {outputs[0], outputs[1], outputs[2]};
    state.q_world = glm::dquat(outputs[6], outputs[7], outputs[8], outputs[9]);
    return error_of(row(), state, rtstdb::world_time_ns(time_ns));
  }

  rtstdb::EntityId capsule_;
};

TEST_F(FreeBodyModule, RowsAreWithinTheirErrorsAtEveryTick) {
  const auto module = make(", position_error: 1 mm, angle_error: 1 mrad");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  std::vector<double> outputs;
  for (int i = 0; i < 4'000; ++i) {
    const auto values = inputs(i / 500 % 2 == 0 ? 6.0 : 0.0, i / 800 % 2 == 0 ? 0.4 : -0.4);
    outputs = step(*module, static_cast<std::uint64_t>(i), i * ms, ms, values);
    const RowError error = error_of_row(outputs, i * ms);
    ASSERT_LE(error.position_m, 1e-3) << "tick " << i;
    ASSERT_LE(error.angle_rad, 1e-3) << "tick " << i;
  }
  EXPECT_GT(outputs[rows_output], 10.0);
  EXPECT_LT(outputs[rows_output], 400.0) << "of 4000 steps";
  EXPECT_TRUE(events_.events().empty());
}

TEST_F(FreeBodyModule, StepsDoNotAllocate) {
  const auto module = make(", position_error: 0.01 mm");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  allocation_guard::reset();
  std::vector<double> outputs;
  for (int i = 0; i < 500; ++i)
    outputs = step(*module, static_cast<std::uint64_t>(i), i * ms, ms, inputs(6.0, 0.4, i > 400 ? 1.0 : 0.0));
  EXPECT_GT(outputs[rows_output], 50.0);
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

TEST_F(FreeBodyModule, StartsWithTheMotionOfItsEntityAndWritesNothingWithoutNeed) {
  const auto module = make(", position_error: 1 m, angle_error: 1 rad");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  const rtstdb::Version before = database_->latest().version;
  std::vector<double> outputs = step(*module, 0, 0, ms, inputs(0.0, 0.0));
  EXPECT_EQ(std::vector<double>(outputs.begin(), outputs.begin() + 6),
            (std::vector<double>{3.0, 0.0, 0.0, 0.0, 1.0, 0.0}));
  EXPECT_DOUBLE_EQ(outputs[11], 0.8);
  outputs = step(*module, 1, 500 * ms, ms, inputs(0.0, 0.0));
  EXPECT_NEAR(outputs[1], 0.5, 1e-12);
  EXPECT_EQ(outputs[rows_output], 0.0);
  EXPECT_EQ(database_->latest().version, before);
}

TEST_F(FreeBodyModule, MotionDoesNotDependOnSkippedReleases) {
  const auto punctual = make(), late = make();
  ASSERT_TRUE(punctual && late) << diagnostics_.to_text();
  const auto thrust = inputs(5.0, 0.3);
  for (int i = 0; i <= 1'000; ++i) {
    const std::vector<double> expected = step(*punctual, static_cast<std::uint64_t>(i), i * ms, ms, thrust);
    if (i % 5 == 3 || (i > 400 && i < 700)) continue;
    const std::vector<double> outputs = step(*late, static_cast<std::uint64_t>(i), i * ms, ms, thrust);
    for (std::size_t k = 0; k < rows_output; ++k)
      ASSERT_NEAR(outputs[k], expected[k], 1e-10) << "output " << k << ", tick " << i;
  }
}

/// A step of the module that is not a multiple of `integration_step` is divided into more and shorter ones.
TEST_F(FreeBodyModule, IntegrationStepsAreNotLongerThanPermitted) {
  const auto module = make(", integration_step: 100 ms", 190 * ms);
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  const glm::dmat3 inertia(glm::dvec3(1.0, 0.0, 0.0), glm::dvec3(0.0, 2.0, 0.0), glm::dvec3(0.0, 0.0, 2.7));
  const RigidBody body({.mass_kg = 10.0, .inertia_kgm2 = inertia}, 0.0);
  RigidBodyState state =
      body.state({3.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, glm::dquat(1.0, 0.0, 0.0, 0.0), {0.1, 0.8, 0.05});
  const Wrench wrench{.force_body_n = {5.0, 0.0, 0.0}, .torque_body_nm = {0.0, 0.0, 0.3}};
  const auto thrust = inputs(5.0, 0.3);
  step(*module, 0, 0, 190 * ms, thrust);
  for (int i = 1; i < 20; ++i) {
    const std::vector<double> outputs =
        step(*module, static_cast<std::uint64_t>(i), i * 190 * ms, 190 * ms, thrust);
    state = body.step(body.step(state, wrench, 0.095), wrench, 0.095);
    for (int k = 0; k < 3; ++k) {
      ASSERT_NEAR(outputs[k], state.p_world_m[k], 1e-12) << "step " << i;
      ASSERT_NEAR(outputs[k + 10], body.w_body_radps(state)[k], 1e-12) << "step " << i;
    }
  }
}

TEST_F(FreeBodyModule, StaleAndInfiniteInputsAreNoForce) {
  const auto module = make();
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  auto values = inputs(100.0, 0.0);
  values[0].fresh = false;
  values[1].value = std::numeric_limits<double>::quiet_NaN();
  values[2].value = std::numeric_limits<double>::infinity();
  step(*module, 0, 0, ms, values);
  const std::vector<double> outputs = step(*module, 1, 1'000 * ms, ms, values);
  EXPECT_NEAR(outputs[3], 0.0, 1e-12);
  EXPECT_NEAR(outputs[4], 1.0, 1e-12);
  EXPECT_NEAR(outputs[5], 0.0, 1e-12);
}

TEST_F(FreeBodyModule, HeldBodyIsAtRest) {
  const auto module = make();
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  step(*module, 0, 0, ms, inputs(5.0, 0.3));
  const std::vector<double> caught = step(*module, 1, 100 * ms, ms, inputs(5.0, 0.3, 1.0));
  const std::vector<double> later = step(*module, 2, 900 * ms, ms, inputs(5.0, 0.3, 1.0));
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(later[k], caught[k]);
    EXPECT_EQ(later[k + 3], 0.0);
    EXPECT_NEAR(later[k + 10], 0.0, 1e-15);
  }
  const rtstdb::Motion motion = row();
  EXPECT_EQ(glm::length(motion.v_world_mps), 0.0);
  EXPECT_LT(glm::length(motion.w_world_radps), 1e-15);
  ASSERT_EQ(events_.events().size(), 1U);
  EXPECT_EQ(events_.events()[0].text, "capsule is held");
  const std::vector<double> free = step(*module, 3, 1'000 * ms, ms, inputs(0.0, 0.0));
  EXPECT_EQ(free[0], caught[0]);
}

TEST_F(FreeBodyModule, BodyThatLeavesTheWorldStops) {
  const auto module = make("", 1'000 * ms);
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  const auto thrust = inputs(1e7, 0.0);
  std::vector<double> outputs;
  for (int i = 0; i < 20; ++i) {
    outputs = step(*module, static_cast<std::uint64_t>(i), i * 1'000 * ms, 1'000 * ms, thrust);
    if (i == 0) {
      EXPECT_EQ(outputs.back(), 0.0);
    }
  }
  EXPECT_EQ(outputs.back(), 1.0) << "stopped";
  // It rests in the world where the outputs say, at any time.
  const rtstdb::Motion motion = row();
  EXPECT_EQ(glm::length(motion.v_world_mps), 0.0);
  EXPECT_EQ(glm::length(motion.w_world_radps), 0.0);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(outputs[k], motion.p_world_m[k]);
    EXPECT_EQ(outputs[k + 3], 0.0);
    EXPECT_NEAR(outputs[k + 10], 0.0, 1e-12);
  }
  EXPECT_LE(glm::length(motion.p_world_m), 2e5);
  const auto events = events_.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events.back().text.find("capsule stops and rests from now on: it would have reached "), 0U);
}

TEST_F(FreeBodyModule, RowsThatCanNotFollowAreAnEvent) {
  const auto module = make(", position_error: 0.001 mm, integration_step: 1 ms", 500 * ms);
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  for (int i = 0; i < 10; ++i)
    step(*module, static_cast<std::uint64_t>(i), i * 500 * ms, 500 * ms, inputs(50.0, 0.5));
  ASSERT_EQ(events_.events().size(), 1U);
  EXPECT_EQ(events_.events()[0].text.find("the motion of capsule changes faster"), 0U);
}

}  // namespace
}  // namespace hil::modules
