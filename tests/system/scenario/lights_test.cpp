// A run with lights: what its log, its history and its export have of them, and refused mistakes.

#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <vector>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/two_blocks.hpp"

namespace hil::scenario_test {
namespace {

const char* const scene = R"(
scenario: lights
duration: 100 ms
clock: virtual
world:
  materials:
    - {name: lacquer, base_color: [0.5, 0.25, 0.125], roughness: 0.25, emission: 2 cd/m2}
  lights:
    - {name: lamp, kind: spot, intensity: 2 kcd, color: [1, 0.5, 0.25], inner_angle: 0.5 rad, outer_angle: 1 rad}
    - {name: day, kind: sky, zenith: 3 cd/m2, horizon: {luminance: 4 cd/m2, color: [0.5, 1, 1]}}
  entities:
    - {name: car, shape: {box: [4 m, 2 m, 1 m]}, velocity: [10 m/s, 0 m/s, 0 m/s], material: lacquer, light: lamp}
    - {name: sky, light: day, position: [1 m, 2 m, 3 m]}
)";

std::vector<Json> exported(const std::string& out) {
  const Ended ended = run_hil({"db", "export", out, "--no-meshes"});
  EXPECT_EQ(ended.code, 0) << ended.errors;
  std::vector<Json> lines;
  std::istringstream text(ended.output);
  for (std::string line; std::getline(text, line);)
    lines.push_back(Json::parse(line));
  return lines;
}

TEST(LightsRun, LogHasMaterialsLightsAndTheirEntities) {
  const ScenarioFolder files(scene);
  const std::string out = files.folder / "out";
  const Ended run = run_hil({"run", files.folder / "s.yaml", "--out", out});
  ASSERT_EQ(run.code, 0) << run.output << run.errors;
  EXPECT_EQ(run_hil({"db", "verify", out}).code, 0);

  std::map<std::string, Json> line;  // materials, lights and geometries by name, rows by entity
  for (const Json& json : exported(out)) {
    if (json.contains("name")) line[json["name"]] = json;
    if (json["line"] != "commit") continue;
    for (const Json& write : json["writes"])
      line["entity " + write["entity"][0].dump()] = write["row"];
  }
  EXPECT_EQ(line["lacquer"], Json::parse(R"({"line": "material", "material": 1, "name": "lacquer",
      "reflectance": 1.0, "retro_gain": 0.0, "base_color": [0.5, 0.25, 0.125], "metallic": 0.0,
      "roughness": 0.25, "emission_cdpm2": [2.0, 2.0, 2.0], "transmission": 0.0, "refractive_index": 1.5})"));
  EXPECT_EQ(line["lamp"], Json::parse(R"({"line": "light", "light": 0, "name": "lamp", "kind": "spot",
      "color": [1.0, 0.5, 0.25], "p_m": [0.0, 0.0, 0.0], "illuminance_lx": 0.0, "intensity_cd": 2000.0,
      "inner_angle_rad": 0.5,
      "outer_angle_rad": 1.0, "angular_diameter_rad": 0.0, "zenith_cdpm2": [0.0, 0.0, 0.0],
      "horizon_cdpm2": [0.0, 0.0, 0.0], "ground_cdpm2": [0.0, 0.0, 0.0]})"));
  EXPECT_EQ(line["day"]["kind"], "sky");
  EXPECT_EQ(line["day"]["zenith_cdpm2"], Json::parse("[3.0, 3.0, 3.0]"));
  EXPECT_EQ(line["day"]["horizon_cdpm2"], Json::parse("[2.0, 4.0, 4.0]"));
  EXPECT_EQ(line["entity 0"]["material"], 1);
  EXPECT_EQ(line["entity 0"]["light"], 0);
  EXPECT_EQ(line["entity 1"]["geometry"], nullptr) << "a light alone";
  EXPECT_EQ(line["entity 1"]["light"], 1);

  const Json past = answer({"history", out, "--json", "entities", "--at", "50ms"});
  const Json& entities = past["answers"][0]["entities"];
  ASSERT_EQ(entities.size(), 2u);
  EXPECT_NEAR(entities[0]["p_world_m"][0].get<double>(), 0.5, 1e-9) << "the light moves with its entity";
  EXPECT_EQ(entities[1]["name"], "sky");
}

TEST(LightsRun, MistakesAreRefusedWithTheirPlace) {
  const ScenarioFolder files(scene);
  const auto refusal = [&](const std::string& option) {
    const Ended ended = run_hil({"check", files.folder / "s.yaml", "--set", option});
    EXPECT_EQ(ended.code, 2) << ended.output;
    return ended.output + ended.errors;
  };
  const std::pair<const char*, const char*> mistakes[] = {
      {"world.entities.sky.light=dya", "unknown light 'dya'; did you mean 'day'?"},
      {"world.lights.lamp.intensity=5 lx", "a luminous intensity is written in cd, kcd"},
      {"world.lights.lamp.zenith=1 cd/m2", "there is no 'world.lights.lamp.zenith'"},
      {"world.lights.lamp.inner_angle=2 rad", "at most the 'outer_angle'"},
      {"world.materials.lacquer.base_color=red", "expected a colour"}};
  for (const auto& [option, words] : mistakes)
    EXPECT_NE(refusal(option).find(words), std::string::npos) << refusal(option);
}

}  // namespace
}  // namespace hil::scenario_test
