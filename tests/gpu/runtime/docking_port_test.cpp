// A docking port in a world: which chasers it captures, and which miss it.

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <numbers>

#include "configs/docking/modules/docking.hpp"
#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t period_ns = 10'000'000;
enum Output : std::size_t {
  distance = 0,
  lateral = 1,
  docked = 6,
  missed = 7,
  capture_lateral = 8,
  capture_speed = 10,
  touches = 11,
  touch_speed = 12,
  undecided = 13
};

class DockingPortModule : public test::ModuleFixture {
 protected:
  DockingPortModule() : ModuleFixture({"body"}) {}

  void SetUp() override {
    ModuleFixture::SetUp();
    world_->create("station", {});
  }

  /// A chaser whose port is 1 m ahead of its origin comes to the station's port at the origin from x = 2 m,
  /// with these speeds along the axis and across it. In the plane of that port it is `lateral_m` from
  /// the axis. Returns the outputs after 30 s.
  std::vector<double> approach(const std::string& name, double speed_mps, double lateral_m, double turned_rad,
                               double lateral_speed_mps = 0.0) {
    rtstdb::EntityRow row;
    row.motion.p_world_m = {3.0, lateral_m - lateral_speed_mps * 2.0 / speed_mps, 0.0};
    row.motion.q_world = glm::angleAxis(std::numbers::pi + turned_rad, glm::dvec3(0.0, 0.0, 1.0));
    row.motion.v_world_mps = {-speed_mps, lateral_speed_mps, 0.0};
    return outputs_of(name, row);
  }

  /// After 30 s, with this chaser.
  std::vector<double> outputs_of(const std::string& name, const rtstdb::EntityRow& row,
                                 const std::string& more = "") {
    world_->create(name, row);
    const auto module =
        make(docking_port_type(),
             "{target: {body: station}, chaser: {body: " + name + ", position: [1 m, 0 m, 0 m]}" + more + "}",
             {.instance = "port", .period_ns = period_ns});
    EXPECT_NE(module, nullptr) << diagnostics_.to_text();
    std::vector<double> outputs;
    for (int i = 0; i < 3'000; ++i)
      outputs = step(*module, static_cast<std::uint64_t>(i), i * period_ns, period_ns);
    return outputs;
  }
};

TEST_F(DockingPortModule, CapturesASlowChaserInTheMiddle) {
  allocation_guard::reset();
  const std::vector<double> outputs = approach("chaser", 0.08, 0.05, 0.0);
  EXPECT_EQ(allocation_guard::seen().total(), 0U) << "in the steps";
  EXPECT_EQ(outputs[docked], 1.0);
  EXPECT_EQ(outputs[missed], 0.0);
  EXPECT_NEAR(outputs[capture_lateral], 0.05, 1e-9);
  EXPECT_NEAR(outputs[capture_speed], 0.08, 1e-9);
  ASSERT_EQ(events_.events().size(), 1U);
  EXPECT_EQ(events_.events()[0].text, "chaser is captured at 0.080 m/s");
}

TEST_F(DockingPortModule, MissesWhatIsTooFastTooFarAsideOrTurned) {
  EXPECT_EQ(approach("fast", 0.12, 0.0, 0.0)[docked], 0.0);
  EXPECT_EQ(approach("aside", 0.08, 0.11, 0.0)[docked], 0.0);
  EXPECT_EQ(approach("turned", 0.08, 0.0, 0.08)[docked], 0.0);
  EXPECT_EQ(events_.events().size(), 3U);
  EXPECT_EQ(approach("aside_too", 0.08, 0.11, 0.0)[missed], 1.0);
}

TEST_F(DockingPortModule, MissesWhatSlidesAcrossTheAxis) {
  EXPECT_EQ(approach("slow", 0.08, 0.0, 0.0, 0.035)[docked], 1.0);
  EXPECT_EQ(approach("sliding", 0.08, 0.0, 0.0, 0.06)[docked], 0.0);
}

/// A chaser that leaves from behind the port: it is captured at a permitted speed alone, and never missed.
TEST_F(DockingPortModule, LimitsTheSpeedInBothDirections) {
  rtstdb::EntityRow row;
  row.motion.p_world_m = {0.0, 0.0, 0.0};
  row.motion.q_world = glm::angleAxis(std::numbers::pi, glm::dvec3(0.0, 0.0, 1.0));
  row.motion.v_world_mps = {0.12, 0.0, 0.0};
  const std::vector<double> fast = outputs_of("fast", row);
  EXPECT_GT(fast[distance], 2.0);
  EXPECT_EQ(fast[docked], 0.0);
  EXPECT_EQ(fast[missed], 0.0);
  row.motion.v_world_mps.x = 0.08;
  EXPECT_EQ(outputs_of("slow", row)[docked], 1.0);
}

TEST_F(DockingPortModule, ReportsNothingOfAChaserThatDidNotArrive) {
  const std::vector<double> outputs = approach("slow", 0.02, 0.3, 0.0);
  EXPECT_NEAR(outputs[distance], 2.0 - 0.02 * 29.99, 1e-9);
  EXPECT_NEAR(outputs[lateral], 0.3, 1e-9);
  EXPECT_EQ(outputs[docked], 0.0);
  EXPECT_EQ(outputs[missed], 0.0);
  EXPECT_TRUE(events_.events().empty());
}

/// A box of 2 m comes to a plate whose front is in the plane of the port. It is captured in the step in which
/// it begins to touch, if it is slow enough then; the other limits hold far longer.
TEST_F(DockingPortModule, WithARingCapturesByASoftTouchAlone) {
  rtstdb::EntityRow ring;
  ring.geometry = world_->add_geometry(rtstdb::make_box({0.2, 1.0, 1.0}), "ring");
  ring.motion.p_world_m = {-0.1, 0.0, 0.0};
  world_->create("ring", ring);
  rtstdb::EntityRow row;
  row.geometry = world_->add_geometry(rtstdb::make_box({2.0, 1.0, 1.0}), "chaser");
  row.motion.p_world_m = {3.0, 0.02, 0.0};
  row.motion.q_world = glm::angleAxis(std::numbers::pi, glm::dvec3(0.0, 0.0, 1.0));
  const std::string with_ring = ", ring: ring, capture: {distance: 50 mm}";
  row.motion.v_world_mps = {-0.08, 0.0, 0.0};
  const std::vector<double> soft = outputs_of("soft", row, with_ring);
  EXPECT_EQ(soft[docked], 1.0);
  EXPECT_EQ(soft[touches], 1.0);
  EXPECT_NEAR(soft[touch_speed], 0.08, 1e-9);
  EXPECT_NEAR(soft[capture_speed], 0.08, 1e-9);
  row.motion.v_world_mps = {-0.12, 0.0, 0.0};
  allocation_guard::reset();
  const std::vector<double> hard = outputs_of("hard", row, with_ring);
  EXPECT_EQ(allocation_guard::seen().total(), 0U) << "in the steps";
  EXPECT_EQ(hard[docked], 0.0);
  EXPECT_EQ(hard[touches], 1.0);
  EXPECT_NEAR(hard[touch_speed], 0.12, 1e-9);
  EXPECT_EQ(hard[undecided], 0.0);
  // Beside the plate it is within all limits but touches nothing.
  row.motion.v_world_mps = {-0.08, 0.0, 0.0};
  row.motion.p_world_m = {3.0, 0.0, 1.05};
  const std::vector<double> beside =
      outputs_of("beside", row, ", ring: ring, capture: {distance: 50 mm, lateral: 2 m}");
  EXPECT_EQ(beside[docked], 0.0);
  EXPECT_EQ(beside[touches], 0.0);
}

}  // namespace
}  // namespace hil::modules
