// Materials and lights of a scenario, and the entities that name them.

#include <cmath>
#include <numbers>

#include "runtime/config/color.hpp"
#include "runtime/config/world_limits.hpp"
#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using Channels = std::array<double, 3>;

class Optics : public ::testing::Test {
 protected:
  /// A scenario with these materials, lights and entities.
  static std::string scenario(const std::string& materials, const std::string& lights,
                              const std::string& entities) {
    return "scenario: a\nworld:\n  materials: [" + materials + "]\n  lights: [" + lights +
           "]\n  entities: [" + entities + "]\n";
  }
  World load(const std::string& text) {
    Diagnostics diagnostics;
    const auto loaded = files_.load(text, diagnostics);
    EXPECT_TRUE(loaded) << diagnostics.to_text();
    return loaded ? loaded->world : World{};
  }
  WorldMaterial material(const std::string& properties) {
    const World world = load(scenario("{name: m" + properties + "}", "", ""));
    return world.materials.empty() ? WorldMaterial{} : world.materials[0];
  }
  WorldLight light(const std::string& properties) {
    const World world = load(scenario("", "{name: l, " + properties + "}", ""));
    return world.lights.empty() ? WorldLight{} : world.lights[0];
  }
  /// Its one mistake, without the file, as "LINE:COLUMN: sentence".
  std::string refusal(const std::string& text) {
    Diagnostics diagnostics;
    EXPECT_FALSE(files_.load(text, diagnostics)) << text;
    EXPECT_EQ(diagnostics.count(), 1U) << diagnostics.to_text();
    const std::string mistake = diagnostics.to_text();
    const std::string file = "scenario.yaml:";
    return mistake.substr(mistake.find(file) + file.size());
  }
  std::string refused_material(const std::string& properties) {
    return refusal(scenario("{name: m, " + properties + "}", "", ""));
  }
  std::string refused_light(const std::string& properties) {
    return refusal(scenario("", "{name: l, " + properties + "}", ""));
  }
  std::string refused_entity(const std::string& properties) {
    return refusal(scenario("{name: paint}", "{name: lamp, kind: point, intensity: 1 cd}",
                            "{name: e, " + properties + "}"));
  }

  test::ScenarioFolder files_;
};

TEST_F(Optics, MaterialsAreReadWithTheirDefaults) {
  const WorldMaterial plain = material("");
  EXPECT_EQ(plain.reflectance, 1.0);
  EXPECT_EQ(plain.retro_gain, 0.0);
  EXPECT_EQ(plain.base_color, (Channels{0.8, 0.8, 0.8}));
  EXPECT_EQ(plain.metallic, 0.0);
  EXPECT_EQ(plain.roughness, 1.0);
  EXPECT_EQ(plain.emission_cdpm2, (Channels{0.0, 0.0, 0.0}));
  EXPECT_EQ(plain.transmission, 0.0);
  EXPECT_EQ(plain.refractive_index, 1.5);
  const WorldMaterial full = material(
      ", base_color: [0, 0.5, 1], metallic: 1, roughness: 0.25, transmission: 0.5, refractive_index: 4, "
      "emission: {luminance: 2 kcd/m2, color: [1, 0.5, 0]}, reflectance: 0.5, retro_gain: 7");
  EXPECT_EQ(full.base_color, (Channels{0.0, 0.5, 1.0}));
  EXPECT_EQ(full.metallic, 1.0);
  EXPECT_EQ(full.roughness, 0.25);
  EXPECT_EQ(full.emission_cdpm2, (Channels{2000.0, 1000.0, 0.0}));
  EXPECT_EQ(full.transmission, 0.5);
  EXPECT_EQ(full.refractive_index, 4.0);
  EXPECT_EQ(full.reflectance, 0.5);
  EXPECT_EQ(full.retro_gain, 7.0);
  EXPECT_EQ(material(", emission: 3 cd/m2").emission_cdpm2, (Channels{3.0, 3.0, 3.0})) << "white";
}

TEST_F(Optics, LightsAreReadByKind) {
  const WorldLight sun = light("kind: directional, illuminance: 100 klx, angular_diameter: 9 mrad");
  EXPECT_EQ(sun.kind, "directional");
  EXPECT_EQ(sun.illuminance_lx, 1e5);
  EXPECT_EQ(sun.angular_diameter_rad, 0.009);
  EXPECT_EQ(sun.color, (Channels{1.0, 1.0, 1.0}));
  const WorldLight lamp = light("kind: point, intensity: 1.5 kcd, color: [1000, 1, 0]");
  EXPECT_EQ(lamp.kind, "point");
  EXPECT_EQ(lamp.intensity_cd, 1500.0);
  EXPECT_EQ(lamp.color, (Channels{1000.0, 1.0, 0.0}));
  const WorldLight beam = light("kind: spot, intensity: 1 cd, inner_angle: 90 deg, outer_angle: 180 deg");
  EXPECT_EQ(beam.kind, "spot");
  EXPECT_DOUBLE_EQ(beam.inner_angle_rad, std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(beam.outer_angle_rad, std::numbers::pi);
  EXPECT_EQ(light("kind: spot, intensity: 1 cd, outer_angle: 1 rad").inner_angle_rad, 0.0);
  const WorldLight sky =
      light("kind: sky, zenith: 3 cd/m2, horizon: {luminance: 4 cd/m2, color: [0.5, 1, 1]}, ground: 1 cd/m2");
  EXPECT_EQ(sky.kind, "sky");
  EXPECT_EQ(sky.zenith_cdpm2, (Channels{3.0, 3.0, 3.0}));
  EXPECT_EQ(sky.horizon_cdpm2, (Channels{2.0, 4.0, 4.0}));
  EXPECT_EQ(sky.ground_cdpm2, (Channels{1.0, 1.0, 1.0}));
}

TEST_F(Optics, HexColoursAreSrgb) {
  const Channels red = material(", base_color: '#ff8000'").base_color;
  EXPECT_EQ(red[0], 1.0);
  EXPECT_NEAR(red[1], 0.2158605, 1e-7);
  EXPECT_EQ(red[2], 0.0);
  EXPECT_NEAR(read_srgb_color("#0A0a0A").value()[0], 10.0 / 255.0 / 12.92, 1e-12) << "the linear part";
  for (const char* text : {"", "#", "#fff", "#gg0000", "#ff00000", "ff0000", "#+10000", "#0x0000", "#ff 000"})
    EXPECT_FALSE(read_srgb_color(text)) << text;
}

TEST_F(Optics, WrongMaterialsAreRefusedAtTheirPlace) {
  const std::string colour =
      ": expected a colour ([r, g, b], linear from 0 to 1, or '#rrggbb' in quotes, sRGB), found ";
  EXPECT_EQ(refused_material("base_color: red"), "3:37: 'base_color'" + colour + "'red'\n");
  EXPECT_EQ(refused_material("base_color: {}"), "3:37: 'base_color'" + colour + "keys and values\n");
  EXPECT_EQ(refused_material("base_color: [0, 1]"), "3:37: 'base_color': a list of 2; expected 3\n");
  EXPECT_EQ(refused_material("base_color: [0, 1, 1.5]"),
            "3:44: entry 2 of 'base_color': 1.5 is out of range; it can be from 0 to 1\n");
  for (const char* property : {"metallic", "roughness", "transmission"}) {
    for (const char* value : {"-0.5", "1.5"})
      EXPECT_NE(refused_material(std::string(property) + ": " + value).find("it can be from 0 to 1\n"),
                std::string::npos)
          << property;
  }
  EXPECT_NE(refused_material("refractive_index: 0.5").find("it can be from 1 to 4"), std::string::npos);
  EXPECT_NE(refused_material("refractive_index: 4.5").find("it can be from 1 to 4"), std::string::npos);
  EXPECT_EQ(refused_material("emission: 5 lx"),
            "3:35: 'luminance': '5 lx' has the unit 'lx', but a luminance is written in cd/m2, cd/m^2, "
            "kcd/m2\n");
  EXPECT_NE(refused_material("emission: 5").find("has no unit"), std::string::npos);
  EXPECT_NE(refused_material("emission: -1 cd/m2").find("out of range"), std::string::npos);
  EXPECT_NE(refused_material("emission: 1e11 cd/m2").find("out of range"), std::string::npos);
}

TEST_F(Optics, WrongLightsAreRefusedAtTheirPlace) {
  EXPECT_EQ(refused_light("kind: skyy, zenith: 1 cd/m2"),
            "4:28: 'kind': 'skyy' is unknown; did you mean 'sky'?\n");
  EXPECT_EQ(refused_light("intensity: 1 cd"),
            "4:12: entry 0 of 'lights': missing key 'kind'; known here: directional, point, spot, sky\n");
  EXPECT_EQ(refused_light("kind: sky, zenith: 1 cd/m2, horizon: 1 cd/m2, intensity: 5 cd"),
            "4:68: unknown key 'intensity'; known here: name, zenith, horizon, ground, kind\n");
  EXPECT_EQ(refused_light("kind: point, intensity: 1 cd, outer_angle: 5 deg"),
            "4:52: unknown key 'outer_angle'; known here: name, intensity, color, position, kind\n");
  EXPECT_NE(refused_light("kind: point").find("missing key 'intensity'"), std::string::npos);
  EXPECT_NE(refused_light("kind: spot, intensity: 1 cd").find("missing key 'outer_angle'"),
            std::string::npos);
  EXPECT_NE(refused_light("kind: directional, illuminance: 5 cd").find("has the unit 'cd'"),
            std::string::npos);
  for (const char* properties :
       {"kind: directional, illuminance: 0 lx", "kind: directional, illuminance: 20000 klx",
        "kind: directional, illuminance: 1 lx, angular_diameter: 0.3 rad", "kind: point, intensity: 0 cd",
        "kind: point, intensity: 1e11 cd", "kind: point, intensity: 1 cd, color: [1, 1, 1001]",
        "kind: spot, intensity: 1 cd, outer_angle: 0 deg",
        "kind: spot, intensity: 1 cd, outer_angle: 181 deg",
        "kind: sky, zenith: 1e11 cd/m2, horizon: 1 cd/m2"})
    EXPECT_NE(refused_light(properties).find("is out of range"), std::string::npos) << properties;
  EXPECT_EQ(refused_light("kind: spot, intensity: 1 cd, inner_angle: 50 deg, outer_angle: 40 deg"),
            "4:64: 'inner_angle' is 50 deg; at most the 'outer_angle', 40 deg, is possible\n");
  EXPECT_EQ(refused_light("kind: point, intensity: 1 cd, color: [0, 0, 0]"),
            "4:59: 'color' is 0 in all channels; one has to be above 0\n");
}

TEST_F(Optics, EntitiesNameLights) {
  const World world = load(scenario("", "{name: lamp, kind: point, intensity: 1 cd}",
                                    "{name: a, shape: {sphere: 1 m}}, {name: b, shape: {sphere: 1 m}, light: "
                                    "lamp}, {name: c, light: lamp}"));
  ASSERT_EQ(world.entities.size(), 3U);
  EXPECT_FALSE(world.entities[0].light);
  EXPECT_EQ(world.entities[1].light->text, "lamp");
  EXPECT_TRUE(world.entities[1].is_body());
  EXPECT_EQ(world.entities[2].light->text, "lamp");
  EXPECT_FALSE(world.entities[2].is_body());
}

TEST_F(Optics, WrongEntitiesAreRefusedAtTheirPlace) {
  EXPECT_EQ(refused_entity("shape: {sphere: 1 m}, light: lmap"),
            "5:53: unknown light 'lmap'; did you mean 'lamp'?\n");
  EXPECT_EQ(refused_entity("mask: [static]"),
            "5:14: missing key 'shape' (The form and size of the entity), or 'light'\n");
  EXPECT_EQ(refused_entity("light: lamp, material: paint"),
            "5:47: 'material' belongs to a 'shape', which the entity lacks\n");
  EXPECT_EQ(refused_entity("light: lamp, field: {}"),
            "5:44: 'field' belongs to a 'shape', which the entity lacks\n");
  EXPECT_EQ(refused_entity("light: lamp, solid: {shape: {box: [1 m, 1 m, 1 m]}}"),
            "5:44: 'solid' belongs to a 'shape', which the entity lacks\n");
  const std::string lamps = "{name: lamp, kind: point, intensity: 1 cd}, ";
  EXPECT_EQ(
      refusal(scenario("", lamps + "{name: lamp, kind: point, intensity: 2 cd}", "{name: a, light: lmap}")),
      "4:63: the light 'lamp' is given twice; first in line 4\n")
      << "the unknown light may be the second one";
}

}  // namespace
}  // namespace hil::config
