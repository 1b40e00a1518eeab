#include "runtime/run/scene_optics.hpp"

#include <gtest/gtest.h>

namespace hil::run {
namespace {

TEST(SceneOptics, PropertiesOfMaterialsAreThoseOfTheScenario) {
  config::WorldMaterial material;
  material.reflectance = 0.5;
  material.retro_gain = 7.0;
  material.base_color = {0.1, 0.2, 0.3};
  material.metallic = 0.25;
  material.roughness = 0.75;
  material.emission_cdpm2 = {4.0, 5.0, 6.0};
  material.transmission = 0.125;
  material.refractive_index = 2.0;
  EXPECT_EQ(material_of(material), (rtstdb::Material{.reflectance = 0.5,
                                                     .retro_gain = 7.0,
                                                     .base_color{0.1, 0.2, 0.3},
                                                     .metallic = 0.25,
                                                     .roughness = 0.75,
                                                     .emission_cdpm2{4.0, 5.0, 6.0},
                                                     .transmission = 0.125,
                                                     .refractive_index = 2.0}));
}

TEST(SceneOptics, PropertiesOfLightsAreThoseOfTheScenario) {
  config::WorldLight light;
  light.kind = "sky";
  light.color = {0.1, 0.2, 0.3};
  light.illuminance_lx = 1.0;
  light.intensity_cd = 2.0;
  light.inner_angle_rad = 3.0;
  light.outer_angle_rad = 4.0;
  light.angular_diameter_rad = 5.0;
  light.zenith_cdpm2 = {6.0, 7.0, 8.0};
  light.horizon_cdpm2 = {9.0, 10.0, 11.0};
  light.ground_cdpm2 = {12.0, 13.0, 14.0};
  EXPECT_EQ(light_of(light), (rtstdb::Light{.kind = rtstdb::LightKind::sky,
                                            .color{0.1, 0.2, 0.3},
                                            .illuminance_lx = 1.0,
                                            .intensity_cd = 2.0,
                                            .inner_angle_rad = 3.0,
                                            .outer_angle_rad = 4.0,
                                            .angular_diameter_rad = 5.0,
                                            .zenith_cdpm2{6.0, 7.0, 8.0},
                                            .horizon_cdpm2{9.0, 10.0, 11.0},
                                            .ground_cdpm2{12.0, 13.0, 14.0}}));
  for (const auto kind :
       {rtstdb::LightKind::directional, rtstdb::LightKind::point, rtstdb::LightKind::spot}) {
    light.kind = rtstdb::to_string(kind);
    EXPECT_EQ(light_of(light).kind, kind);
  }
}

}  // namespace
}  // namespace hil::run
