// The collision module in a world: what touches, by bounds and by bodies, and the time to the first impact.

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "runtime/modules/vehicles/car_shape.hpp"
#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t period_ns = 10'000'000;

class CollisionModule : public test::ModuleFixture {
 protected:
  CollisionModule() : ModuleFixture({"ego", "traffic"}) {}

  rtstdb::EntityRow row_of(const rtstdb::TriangleMesh& mesh, const std::string& layer,
                           const glm::dvec3& p_m) {
    rtstdb::EntityRow row;
    row.geometry = database_->add_geometry(mesh, layer).value();
    row.mask = world_->mask_of({layer}, "test");
    row.motion.p_world_m = p_m;
    return row;
  }
  std::unique_ptr<AnyModule> collision(const std::string& more) {
    auto module = make(*find_module_type("collision"), "{body: ego, against: [traffic]" + more + "}",
                       {.instance = "collision", .period_ns = period_ns});
    EXPECT_NE(module, nullptr) << diagnostics_.to_text();
    return module;
  }
};

/// A post beside the cabin of a car is in the car's bounds, but touches nothing.
TEST_F(CollisionModule, BodiesTouchWhereBoundsOverlapOnly) {
  const glm::dvec3 size_m(4.4, 1.8, 1.5);
  rtstdb::EntityRow ego = row_of(make_car(size_m), "ego", {0.0, 0.0, 0.75});
  world_->create("ego", ego);
  // Above the bonnet, in front of the cabin.
  rtstdb::EntityRow post = row_of(rtstdb::make_box({0.2, 0.2, 0.4}), "traffic", {1.8, 0.0, 1.3});
  world_->create("post", post);
  EXPECT_EQ(step(*collision(""), 0, 0, period_ns)[0], 1.0);
  const auto by_bodies = collision(", by: bodies");
  EXPECT_EQ(step(*by_bodies, 0, 0, period_ns)[0], 0.0);
  rtstdb::EntityRow lower = row_of(rtstdb::make_box({0.2, 0.2, 0.4}), "traffic", {1.8, 0.5, 1.05});
  world_->create("lower", lower);
  allocation_guard::reset();
  const std::vector<double> outputs = step(*by_bodies, 1, period_ns, period_ns);
  EXPECT_EQ(allocation_guard::seen().total(), 0U) << "in the step";
  EXPECT_EQ(outputs[0], 1.0);
  EXPECT_EQ(outputs[1], 1.0);
  // The bonnet is at 0.9 m.
  EXPECT_NEAR(outputs[2], 0.05, 1e-4);
}

TEST_F(CollisionModule, TimeToImpact) {
  rtstdb::EntityRow ego = row_of(rtstdb::make_box({4.0, 2.0, 1.5}), "ego", {0.0, 0.0, 1.0});
  ego.motion.v_world_mps = {10.0, 0.0, 0.0};
  world_->create("ego", ego);
  rtstdb::EntityRow wall = row_of(rtstdb::make_box({1.0, 6.0, 3.0}), "traffic", {32.5, 0.0, 1.5});
  world_->create("wall", wall);
  const auto module = collision(", by: bodies, impact_window: 4 s");
  EXPECT_NEAR(step(*module, 0, 0, period_ns)[3], 3.0, 1e-3);
  EXPECT_NEAR(step(*module, 50, 500'000'000, period_ns)[3], 2.5, 1e-3);
  const auto shorter = collision(", by: bodies, impact_window: 2 s");
  EXPECT_EQ(step(*shorter, 0, 0, period_ns)[3], 2.0);
}

TEST_F(CollisionModule, BodiesWithoutConvexParts) {
  world_->create("ego", row_of(rtstdb::make_box({4.0, 2.0, 1.5}), "ego", {0.0, 0.0, 1.0}));
  world_->create("sheet", row_of(rtstdb::make_rectangle(3.0, 3.0), "traffic", {2.0, 0.0, 1.0}));
  const auto module = collision(", by: bodies, impact_window: 2 s");
  const std::vector<double> outputs = step(*module, 0, 0, period_ns);
  EXPECT_EQ(outputs[0], 1.0);
  EXPECT_NEAR(outputs[2], 0.75, 0.01) << "the middle of the sheet's part in the body";
  EXPECT_EQ(outputs[3], 0.0);
}

/// Too many pieces are near: nothing is known, and the count stays unknown.
TEST_F(CollisionModule, PiecesBeyondTheLimit) {
  rtstdb::TriangleMesh pieces;
  for (int i = 0; i < 150; ++i) {
    const rtstdb::TriangleMesh box = rtstdb::make_box({1.0, 1.0, 1.0});
    const auto first = static_cast<std::uint32_t>(pieces.positions_m.size());
    for (const glm::vec3& p : box.positions_m)
      pieces.positions_m.push_back(p + glm::vec3(0.001f * static_cast<float>(i), 0.0f, 0.0f));
    for (const glm::uvec3& triangle : box.triangles)
      pieces.triangles.push_back(triangle + first);
  }
  const rtstdb::EntityId ego = world_->create("ego", row_of(pieces, "ego", {0.0, 0.0, 0.0}));
  world_->create("other", row_of(pieces, "traffic", {0.5, 0.0, 0.0}));
  const auto module = collision(", by: bodies");
  std::vector<double> outputs = step(*module, 0, 0, period_ns);
  for (const double output : outputs)
    EXPECT_TRUE(std::isnan(output));
  ASSERT_EQ(events_.events().size(), 1U);
  EXPECT_NE(events_.events()[0].text.find("16384 pairs that are searched"), std::string::npos);
  const auto away = database_->make_transaction({.max_writes = 1});
  away->begin({});
  rtstdb::EntityRow row = database_->snapshot({}).value()[0].row;
  row.motion.p_world_m = {100.0, 0.0, 0.0};
  away->update(ego, row);
  ASSERT_TRUE(database_->execute(*away).done());
  outputs = step(*module, 1, period_ns, period_ns);
  EXPECT_EQ(outputs[0], 0.0);
  EXPECT_TRUE(std::isnan(outputs[1])) << "contacts may have begun unseen";
}

TEST_F(CollisionModule, AnImpactWindowNeedsBodies) {
  world_->create("ego", row_of(rtstdb::make_box({4.0, 2.0, 1.5}), "ego", {0.0, 0.0, 1.0}));
  const ModuleType& type = *find_module_type("collision");
  const auto value = config::parse_text("test", "{body: ego, against: [traffic], impact_window: 1 s}",
                                        type.parameters, diagnostics_);
  ASSERT_TRUE(value);
  EXPECT_EQ(type.create(*value, {.instance = "collision", .period_ns = 1'000'000}, diagnostics_), nullptr);
  EXPECT_NE(diagnostics_.to_text().find("'impact_window' needs 'by: bodies'"), std::string::npos);
}

}  // namespace
}  // namespace hil::modules
