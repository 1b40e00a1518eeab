#include <gtest/gtest.h>

#include <limits>

#include <hil/world/world.hpp>

#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

class ModuleWorld : public test::ModuleFixture {
 protected:
  ModuleWorld() : ModuleFixture({"ground", "structure", "vehicle"}) {}

  /// The text of the SetupError that `action` throws.
  template <typename Action>
  static std::string refusal(Action action) {
    try {
      action();
    } catch (const SetupError& error) {
      return error.what();
    }
    return "no SetupError";
  }
};

TEST_F(ModuleWorld, LayersAreMaskBitsInTheirOrder) {
  EXPECT_EQ(world_->layer_bit("ground"), 1U);
  EXPECT_EQ(world_->layer_bit("vehicle"), 4U);
  EXPECT_FALSE(world_->layer_bit("pole"));
  EXPECT_EQ(world_->mask_of({"vehicle", "ground", "vehicle"}, "module x"), 5U);
  EXPECT_EQ(world_->mask_of({}, "module x"), 0U);
}

TEST_F(ModuleWorld, UnknownLayerIsRefusedWithTheNearestName) {
  EXPECT_EQ(refusal([&] {
              world_->mask_of({"ground", "vehicel"}, "module loops");
            }),
            "module loops: the scenario has no layer 'vehicel'; did you mean 'vehicle'?");
  EXPECT_EQ(refusal([&] { world_->mask_of({"zebra"}, "module loops"); }),
            "module loops: the scenario has no layer 'zebra'; known here: ground, structure, vehicle");
}

TEST_F(ModuleWorld, MaterialsAreFoundByName) {
  const rtstdb::Material foil{.reflectance = 0.9, .retro_gain = 300.0};
  const rtstdb::MaterialId id = world_->add_material("foil", foil);
  EXPECT_EQ(world_->material_of("foil", "module x"), id);
  EXPECT_EQ(database_->material(id), foil);
  EXPECT_EQ(refusal([&] { world_->add_material("foil", foil); }), "two materials have the name 'foil'");
  EXPECT_EQ(refusal([&] { world_->material_of("fool", "module x"); }),
            "module x: world.materials has no material 'fool'; did you mean 'foil'?");
  EXPECT_EQ(refusal([&] { world_->add_material("bright", {.reflectance = 2.0}); }),
            "world.materials: material 'bright': reflectance is 2; allowed is 0 to 1");
}

TEST_F(ModuleWorld, LightsAreFoundByName) {
  const rtstdb::Light lamp{.intensity_cd = 5.0};
  const rtstdb::LightId id = world_->add_light("lamp", lamp);
  EXPECT_EQ(world_->light_of("lamp", "module x"), id);
  EXPECT_EQ(database_->light(id), lamp);
  EXPECT_EQ(refusal([&] { world_->add_light("lamp", lamp); }), "two lights have the name 'lamp'");
  EXPECT_EQ(refusal([&] { world_->light_of("lmap", "module x"); }),
            "module x: world.lights has no light 'lmap'; did you mean 'lamp'?");
  EXPECT_EQ(refusal([&] { world_->add_light("dark", {}); }),
            "world.lights: light 'dark': intensity_cd is 0; allowed is above 0, at most 1e10");
}

TEST_F(ModuleWorld, BodiesOfOneShapeShareAGeometry) {
  int made = 0;
  const auto box = [&] {
    ++made;
    return rtstdb::make_box({2.0, 4.0, 6.0});
  };
  const rtstdb::GeometryId first = world_->shared_geometry("box 2 4 6", box);
  EXPECT_EQ(world_->shared_geometry("box 2 4 6", box), first);
  EXPECT_EQ(made, 1);
  EXPECT_NE(world_->shared_geometry("box 9", box), first);
  EXPECT_EQ(made, 2);
}

TEST_F(ModuleWorld, EntitiesAreFoundByNameWithTheirBounds) {
  rtstdb::EntityRow row;
  row.geometry = world_->add_geometry(rtstdb::make_box({2.0, 4.0, 6.0}), "box");
  const rtstdb::EntityId first = world_->create("house", row);
  row.geometry = world_->add_geometry(rtstdb::make_box({1.0, 1.0, 1.0}), "cube");
  const rtstdb::EntityId second = world_->create("traffic.ego", row);
  EXPECT_EQ(world_->find("house"), first);
  EXPECT_EQ(world_->find("traffic.ego"), second);
  EXPECT_FALSE(world_->find("traffic"));
  EXPECT_EQ(world_->name_of(second), "traffic.ego");
  EXPECT_EQ(world_->name_of({}), "");
  EXPECT_FLOAT_EQ(world_->bounds_of(first).maximum_m.y, 2.0F);
  EXPECT_FLOAT_EQ(world_->bounds_of(second).maximum_m.y, 0.5F);
}

TEST_F(ModuleWorld, DuplicateEntityNameIsRefused) {
  rtstdb::EntityRow row;
  row.geometry = world_->add_geometry(rtstdb::make_box({2.0, 4.0, 6.0}), "box");
  const rtstdb::EntityId first = world_->create("house", row);
  EXPECT_EQ(refusal([&] { world_->create("house", row); }), "two entities have the name 'house'");
  EXPECT_EQ(world_->find("house"), first);
}

TEST_F(ModuleWorld, ErrorsOfTheDatabaseAreReportedWithTheName) {
  EXPECT_EQ(refusal([&] { world_->add_geometry({}, "empty"); }).rfind("empty: ", 0), 0U);
  rtstdb::EntityRow row;
  row.geometry = world_->add_geometry(rtstdb::make_box({1.0, 1.0, 1.0}), "box");
  row.motion.p_world_m.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal([&] { world_->create("ghost", row); }).rfind("entity 'ghost': ", 0), 0U);
  EXPECT_FALSE(world_->find("ghost"));
}

}  // namespace
}  // namespace hil::modules
