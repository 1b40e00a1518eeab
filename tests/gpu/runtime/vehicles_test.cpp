// Vehicles in a world: their outputs and their rows agree while they drive.

#include <gtest/gtest.h>

#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

class VehiclesModule : public test::ModuleFixture {
 protected:
  VehiclesModule() : ModuleFixture({"vehicle"}) {}

  std::unique_ptr<AnyModule> make(const std::string& parameters, const std::string& instance = "traffic") {
    return ModuleFixture::make(*find_module_type("vehicles"), parameters,
                               {.instance = instance, .period_ns = 100 * second_ns});
  }

  rtstdb::EntityRow row_of(const std::string& name) const {
    const auto states = database_->snapshot({});
    if (!states) throw std::runtime_error(states.error().message);
    for (const rtstdb::EntityState& state : states.value()) {
      if (world_->name_of(state.id) == name) return state.row;
    }
    throw std::runtime_error("no body " + name);
  }
  rtstdb::Motion motion_of(const std::string& name) const { return row_of(name).motion; }
};

TEST_F(VehiclesModule, VehicleAtTheBorderIsRemoved) {
  const auto module = make(
      "{vehicles: {far: {position: [9 km, 0 m], speed: 99 m/s, desired_speed: 100 m/s, acceleration: 0.1 "
      "m/s2},"
      " slow: {position: [-9 km, 50 m], speed: 1 m/s, desired_speed: 100 m/s, acceleration: 0.1 m/s2}}}");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  for (std::uint64_t run = 0; run < 13; ++run) {
    const std::vector<double> outputs =
        step(*module, run, static_cast<std::int64_t>(run) * 100 * second_ns, 100 * second_ns);
    if (run == 0) continue;
    EXPECT_DOUBLE_EQ(motion_of("traffic.slow").v_world_mps.x, outputs[7]) << "after step " << run;
  }
  const rtstdb::Motion far = motion_of("traffic.far");
  EXPECT_LE(far.p_world_m.x, 1e5);
  const auto events = events_.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].text, "far leaves the world");
}

TEST_F(VehiclesModule, AVehicleKeepsItsMaterialAndItsLampWhileItDrives) {
  const rtstdb::LightId headlight =
      world_->add_light("headlight", {.kind = rtstdb::LightKind::point, .intensity_cd = 100.0});
  const rtstdb::MaterialId paint = world_->add_material("paint", {.base_color = {1.0, 0.0, 0.0}});
  const auto module = make(
      "{vehicles: {red: {position: [0 m, 0 m], speed: 1 m/s, desired_speed: 9 m/s, material: paint, lamp: "
      "headlight},"
      " plain: {position: [0 m, 9 m], speed: 1 m/s}}}");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  step(*module, 0, 0, second_ns);
  step(*module, 1, second_ns, second_ns);
  EXPECT_EQ(row_of("traffic.red").material, paint);
  EXPECT_EQ(row_of("traffic.red").light, headlight);
  EXPECT_FALSE(row_of("traffic.plain").light.valid());
  EXPECT_EQ(row_of("traffic.plain").material, rtstdb::MaterialId{});
}

/// A car at a constant speed, one that accelerates, and one that approaches the first.
constexpr const char* three_cars =
    "{vehicles: {steady: {position: [0 m, 0 m], speed: 10 m/s},"
    " hasty: {position: [0 m, 50 m], speed: 5 m/s, desired_speed: 30 m/s},"
    " behind: {position: [-40 m, 0 m], speed: 20 m/s}}}";

TEST_F(VehiclesModule, DriverKeepsTheDesiredSpeedOfTheInput) {
  const auto module = make("{vehicles: {car: {position: [0 m, 0 m], speed: 10 m/s}}}");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  const modules::Port& port = module->ports().inputs.at(0);
  EXPECT_EQ(port.name, "car.desired_speed");
  EXPECT_EQ(port.initial, 10.0);
  std::array<signals::SignalValue, 1> inputs{};
  std::uint64_t run = 0;
  const auto speed_after = [&](double desired_mps, std::uint64_t steps) {
    inputs[0].value = desired_mps;
    double speed_mps = 0.0;
    for (const std::uint64_t end = run + steps; run < end; ++run)
      speed_mps =
          step(*module, run, static_cast<std::int64_t>(run) * second_ns / 100, second_ns / 100, inputs)[2];
    return speed_mps;
  };
  EXPECT_NEAR(speed_after(10.0, 100), 10.0, 1e-9);
  EXPECT_NEAR(speed_after(15.0, 6000), 15.0, 0.05);
  EXPECT_NEAR(speed_after(5.0, 6000), 5.0, 0.05);
  const double stopped = speed_after(-1.0, 3000);
  EXPECT_GE(stopped, 0.0);
  EXPECT_LT(stopped, 0.2);
}

TEST_F(VehiclesModule, TravelIsIndependentOfSkippedReleases) {
  constexpr std::int64_t period_ns = second_ns / 100;
  const auto punctual = make(three_cars, "punctual");
  const auto late = make(three_cars, "late");
  ASSERT_TRUE(punctual && late) << diagnostics_.to_text();
  std::uint64_t late_runs = 0;
  for (std::uint64_t run = 0; run <= 300; ++run) {
    const auto time_ns = static_cast<std::int64_t>(run) * period_ns;
    const std::vector<double> expected = step(*punctual, run, time_ns, period_ns);
    if (run % 5 == 3 || (run > 100 && run < 140)) continue;
    const std::vector<double> outputs = step(*late, late_runs++, time_ns, period_ns);
    ASSERT_EQ(outputs, expected) << "at " << time_ns << " ns";
    ASSERT_NEAR(outputs[0], 10.0 * static_cast<double>(time_ns) * 1e-9, 1e-9) << "its row has this position";
  }
}

TEST_F(VehiclesModule, PositionsAfterALongPauseAreThoseOfTheRows) {
  const auto module = make(three_cars);
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  step(*module, 0, 0, second_ns / 1000);
  const std::vector<double> outputs = step(*module, 1, 30 * second_ns, second_ns / 1000);
  EXPECT_NEAR(outputs[0], 300.0, 1e-6);
  EXPECT_GT(outputs[0], outputs[10] + 4.5) << "the following car does not collide";
}

TEST_F(VehiclesModule, FirstReleaseAfterTheStartIncludesTheTravelSoFar) {
  const auto module = make(three_cars);
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  EXPECT_NEAR(step(*module, 0, 5'000'000, second_ns / 100)[0], 0.05, 1e-9);
}

}  // namespace
}  // namespace hil::modules
