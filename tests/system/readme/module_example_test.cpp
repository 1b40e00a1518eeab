// The example module of docs/guide/modules.md.

#include <gtest/gtest.h>

#include "tests/gpu/runtime/module_fixture.hpp"

namespace range_finder {
hil::modules::ModuleType range_finder_type();
}

namespace hil::modules {
namespace {

constexpr std::int64_t ms = 1'000'000;

class GuideRangeFinder : public test::ModuleFixture {
 protected:
  GuideRangeFinder() : ModuleFixture({"vehicle", "structure"}) {}
  void SetUp() override {
    ModuleFixture::SetUp();
    rtstdb::EntityRow car;
    car.geometry = world_->add_geometry(rtstdb::make_box({4.0, 2.0, 1.0}), "car");
    car.mask = *world_->layer_bit("vehicle");
    car.motion.v_world_mps = {10.0, 0.0, 0.0};
    world_->create("traffic.ego", car);
    rtstdb::EntityRow wall = car;
    wall.mask = *world_->layer_bit("structure");
    wall.motion.p_world_m = {52.0, 0.0, 0.0};
    wall.motion.v_world_mps = {0.0, 0.0, 0.0};
    world_->create("wall", wall);
  }

  std::unique_ptr<AnyModule> make(const std::string& parameters) {
    return ModuleFixture::make(range_finder::range_finder_type(), parameters,
                               {.instance = "range", .period_ns = 10 * ms, .deadline_ns = 10 * ms});
  }
  std::vector<double> step(AnyModule& module, std::int64_t time_ns) {
    return ModuleFixture::step(module, 0, time_ns, 10 * ms);
  }
};

TEST_F(GuideRangeFinder, MeasuresTheDistanceFromTheMovingBody) {
  const auto module = make("{carrier: traffic.ego, layers: [structure], range: 80 m}");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  const std::vector<double> at_once = step(*module, 0);
  EXPECT_NEAR(at_once[0], 50.0, 1e-4) << "from the middle of the car to the wall's near face";
  EXPECT_EQ(at_once[1], 1.0);
  EXPECT_NEAR(step(*module, 1'000 * ms)[0], 40.0, 1e-4) << "the car has moved";
}

TEST_F(GuideRangeFinder, ReturnsItsRangeWithoutAHit) {
  const auto module = make("{carrier: traffic.ego, layers: [structure], range: 30 m}");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  EXPECT_EQ(step(*module, 0), (std::vector<double>{30.0, 0.0}));
}

TEST_F(GuideRangeFinder, DeclaresItsBodiesAndLayers) {
  const auto module = make("{carrier: traffic.ego, layers: [structure, vehicle]}");
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  const WorldPorts& ports = module->world_module()->ports();
  ASSERT_EQ(ports.bodies.size(), 1U);
  EXPECT_EQ(ports.bodies[0].text, "traffic.ego");
  EXPECT_EQ(ports.layers.size(), 2U);
}

}  // namespace
}  // namespace hil::modules
