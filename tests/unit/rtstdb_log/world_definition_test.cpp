// Materials and lights in the world that a log is read into: each is the next one or an equal one, and rows
// name known ones.

#include <gtest/gtest.h>

#include "rtstdb/log/world.hpp"

namespace rtstdb::log::test {
namespace {

LoggedMaterial material_of(std::uint32_t index, double reflectance) {
  return {{index}, "paint", {.reflectance = reflectance}};
}

LoggedLight light_of(std::uint32_t index, double intensity_cd) {
  return {{index}, "lamp", {.intensity_cd = intensity_cd}};
}

const char* apply(World& world, Version version, store::WriteKind kind, std::uint32_t generation,
                  MaterialId material, LightId light = {}) {
  EntityRow row;
  row.material = material;
  row.light = light;
  store::WriteSet set{version, world_time_ns(0), {{kind, {{0, generation}, row, version}}}};
  return world.apply(set);
}

TEST(LogWorld, AddsTheNextMaterialOrAnEqualOne) {
  World world;
  EXPECT_TRUE(world.knows(MaterialId{})) << "the default material";
  EXPECT_FALSE(world.knows(MaterialId{1}));
  EXPECT_STREQ(world.add(material_of(2, 0.5)), "it adds a material whose index is not the next");
  EXPECT_EQ(world.add(material_of(1, 0.5)), nullptr);
  EXPECT_TRUE(world.knows(MaterialId{1}));
  EXPECT_EQ(world.add(material_of(1, 0.5)), nullptr) << "again, after a checkpoint that has it";
  EXPECT_STREQ(world.add(material_of(1, 0.25)), "it adds a material with an index that is in use");
  LoggedMaterial renamed = material_of(1, 0.5);
  renamed.name = "foil";
  EXPECT_STREQ(world.add(renamed), "it adds a material with an index that is in use");
  EXPECT_EQ(world.materials.size(), 1u);
}

TEST(LogWorld, AddsTheNextLightOrAnEqualOne) {
  World world;
  EXPECT_FALSE(world.knows(LightId{}));
  EXPECT_FALSE(world.knows(LightId{0}));
  EXPECT_STREQ(world.add(light_of(1, 5.0)), "it adds a light whose index is not the next");
  EXPECT_EQ(world.add(light_of(0, 5.0)), nullptr);
  EXPECT_TRUE(world.knows(LightId{0}));
  EXPECT_EQ(world.add(light_of(0, 5.0)), nullptr) << "again, after a checkpoint that has it";
  EXPECT_STREQ(world.add(light_of(0, 6.0)), "it adds a light with an index that is in use");
  LoggedLight renamed = light_of(0, 5.0);
  renamed.name = "sun";
  EXPECT_STREQ(world.add(renamed), "it adds a light with an index that is in use");
  EXPECT_EQ(world.lights.size(), 1u);
}

TEST(LogWorld, RefusesRowsWithAnUnknownMaterial) {
  World world;
  EXPECT_STREQ(apply(world, 1, store::WriteKind::create, 1, {1}), "it refers to an unknown material");
  EXPECT_EQ(apply(world, 1, store::WriteKind::create, 1, {}), nullptr);
  EXPECT_STREQ(apply(world, 2, store::WriteKind::update, 1, {1}), "it refers to an unknown material");
  ASSERT_EQ(world.add(material_of(1, 0.5)), nullptr);
  EXPECT_EQ(apply(world, 2, store::WriteKind::update, 1, {1}), nullptr);
  EXPECT_EQ(world.rows[0].row.material, MaterialId{1});
}

TEST(LogWorld, RefusesRowsWithAnUnknownLight) {
  World world;
  EXPECT_STREQ(apply(world, 1, store::WriteKind::create, 1, {}, {0}), "it refers to an unknown light");
  EXPECT_EQ(apply(world, 1, store::WriteKind::create, 1, {}), nullptr);
  EXPECT_STREQ(apply(world, 2, store::WriteKind::update, 1, {}, {0}), "it refers to an unknown light");
  ASSERT_EQ(world.add(light_of(0, 5.0)), nullptr);
  EXPECT_EQ(apply(world, 2, store::WriteKind::update, 1, {}, {0}), nullptr);
  EXPECT_EQ(world.rows[0].row.light, LightId{0});
  EXPECT_EQ(apply(world, 3, store::WriteKind::update_motion, 1, {}), nullptr);
  EXPECT_EQ(world.rows[0].row.light, LightId{0}) << "a motion leaves the light";
}

}  // namespace
}  // namespace rtstdb::log::test
