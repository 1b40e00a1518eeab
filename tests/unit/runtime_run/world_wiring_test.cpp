// Mistakes of a scenario's world: shapes, layers, capacities, and what modules require of their tasks.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::run {
namespace {

class WorldWiring : public test::WiringFixture {
 protected:
  /// All mistakes as text, without the folder; empty when the scenario is wired.
  std::string mistakes_of(const std::string& text) {
    wiring_ = wired(text);
    if (!is_loaded_) throw std::runtime_error("refused before the wiring:\n" + diagnostics_.to_text());
    EXPECT_EQ(wiring_.has_value(), diagnostics_.empty());
    std::string mistakes = diagnostics_.to_text();
    const std::string path = folder_.path().string() + "/";
    for (std::size_t at = mistakes.find(path); at != std::string::npos; at = mistakes.find(path))
      mistakes.erase(at, path.size());
    return mistakes;
  }

  std::string mistakes_of_mesh(const std::string& name, const std::string& mesh) {
    folder_.write(name, mesh);
    return mistakes_of("scenario: a\nworld:\n  entities:\n    - {name: a, shape: {file: " + name + "}}\n");
  }

  static std::string scanner(const std::string& rate, const std::string& parameters) {
    return "scenario: a\nworld: {entities: [{name: a, shape: {sphere: 1 m}}, {name: b, shape: {sphere: 1 "
           "m}}]}\ntasks:\n  - module: scanner\n"
           "    type: laser_scanner\n    rate: " +
           rate + "\n    parameters:\n      {carrier: a, layers: [static], object_layers: [static], " +
           parameters + "}\n";
  }

  std::optional<Wiring> wiring_;
};

::testing::AssertionResult begins(const std::string& text, const std::string& with) {
  if (text.starts_with(with)) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "\"" << text << "\" does not begin with \"" << with << "\"";
}

TEST_F(WorldWiring, UnusableMeshFileIsRefusedAtItsPlace) {
  const std::pair<const char*, const char*> meshes[] = {
      {"none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"},
      {"nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n"},
      {"flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"},
      {"far.obj", "v 0 0 0\nv 200000 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"cut.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"},
      {"cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"},
      {"cut.gltf", "{\"asset\": "}};
  for (const auto& [name, mesh] : meshes)
    EXPECT_TRUE(begins(mistakes_of_mesh(name, mesh), "scenario.yaml:4:31: ")) << name;
}

TEST_F(WorldWiring, ConvexPartsAndSolidsThatDoNotFitTheShapeAreRefusedAtTheirPlace) {
  folder_.write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto mistakes = [&](const std::string& more) {
    return mistakes_of("scenario: a\nworld:\n  entities:\n    - {name: a, shape: {box: [2 m, 2 m, 2 m]}, " +
                       more + "}\n");
  };
  const std::string parts = mistakes("convex_parts: part.obj");
  EXPECT_TRUE(begins(parts, "scenario.yaml:4:62: 'convex_parts': the mesh's point (")) << parts;
  EXPECT_NE(parts.find("outside all convex parts; at most 0.1732 m are allowed"), std::string::npos) << parts;
  EXPECT_TRUE(
      begins(mistakes("solid: {shape: {sphere: {radius: 1 m}}}"),
             "scenario.yaml:4:55: 'solid': the sphere is 0.7321 m off the mesh at the mesh's point ("));
  EXPECT_EQ(mistakes("solid: {shape: {box: [2 m, 2 m, 2 m]}}"), "");
}

TEST_F(WorldWiring, MeshIsReadOnceForAllItsEntities) {
  folder_.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(mistakes_of("scenario: a\nworld:\n  entities:\n    - {name: a, shape: {file: a.obj}}\n"
                        "    - {name: b, shape: {file: a.obj}, scale: 3}\n"
                        "    - {name: c, shape: {file: {path: a.obj, scale: 2}}}\n"),
            "");
  EXPECT_EQ(wiring_->scenery.meshes.size(), 2U);
  EXPECT_EQ(wiring_->scenery.mesh_of, (std::vector<std::optional<std::size_t>>{0, 0, 1}));
  EXPECT_FLOAT_EQ(wiring_->scenery.bounds[1].maximum_m.x, 2.0F);
}

TEST_F(WorldWiring, SurfacesOfAMeshFileAreNamedOnce) {
  const std::string mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n";
  folder_.write("both.obj", mesh + "usemtl red\nf 1/1 2/1 3/1\n");
  folder_.write("textured.obj", mesh + "f 1 2 3\n");
  const std::string ignored = ", which are ignored; 'material' gives the surface of an entity\n";
  EXPECT_EQ(mistakes_of("scenario: a\nworld:\n  entities:\n    - {name: a, shape: {file: both.obj}}\n"
                        "    - {name: b, shape: {file: both.obj}}\n"
                        "    - {name: c, shape: {file: {path: both.obj, scale: 2}}}\n"
                        "    - {name: d, shape: {file: textured.obj}}\n"),
            "scenario.yaml:4:31: warning: mesh file 'both.obj' has materials and textures" + ignored +
                "scenario.yaml:7:31: warning: mesh file 'textured.obj' has textures" + ignored);
  EXPECT_TRUE(diagnostics_.empty());
  // Only the corners of convex parts count.
  folder_.write("part.obj",
                "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  folder_.write("body.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_EQ(mistakes_of("scenario: a\nworld:\n  entities:\n"
                        "    - {name: a, shape: {file: body.obj}, convex_parts: part.obj}\n"),
            "");
  EXPECT_EQ(mistakes_of("scenario: a\nworld:\n  entities:\n    - {name: a, shape: {file: part.obj}}\n"),
            "scenario.yaml:4:31: warning: mesh file 'part.obj' has materials" + ignored);
}

TEST_F(WorldWiring, ScaleBeyondTheWorldIsRefused) {
  folder_.write("a.obj", "v 0 0 0\nv 70000 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_TRUE(begins(
      mistakes_of("scenario: a\nworld:\n  entities:\n    - {name: a, shape: {file: a.obj}, scale: 2}\n"),
      "scenario.yaml:4:46: 'scale' takes a corner of the mesh to 140000 m; 100000 m is the farthest"));
}

TEST_F(WorldWiring, EqualShapesShareAGeometry) {
  std::string text = "scenario: a\nworld:\n  max_geometries: 1\n  entities:\n";
  for (int i = 0; i < 1025; ++i)
    text += "    - {name: e" + std::to_string(i) + ", shape: {sphere: 1 m}}\n";
  EXPECT_EQ(mistakes_of(text), "");
  EXPECT_EQ(wiring_->scenery.meshes.size(), 1U);
  // A cylinder as wide as the sphere is another shape.
  EXPECT_TRUE(
      begins(mistakes_of(text + "    - {name: other, shape: {cylinder: {radius: 1 m, height: 1 m}}}\n"),
             "scenario.yaml:1030:28: 2 different shapes so far, but world.max_geometries is 1"));
}

TEST_F(WorldWiring, VehiclesCountAsEntitiesAndTheirSizesAsGeometries) {
  const auto traffic = [](const std::string& limits, int cars, const std::string& more) {
    std::string text =
        "scenario: a\nworld: {" + limits +
        "}\ntasks:\n  - module: traffic\n    type: vehicles\n    rate: 1 kHz\n    parameters:\n"
        "      vehicles:\n";
    for (int i = 0; i < cars; ++i)
      text += "        v" + std::to_string(i) + ": {position: [0 m, 0 m], speed: 1 m/s}\n";
    return text + more;
  };
  EXPECT_EQ(mistakes_of(traffic("max_geometries: 1, max_entities: 3000", 3000, "")), "");
  EXPECT_TRUE(begins(mistakes_of(traffic("max_entities: 2", 3, "")),
                     "scenario.yaml:4:13: module traffic: 3 bodies with those before it, but "
                     "world.max_entities is 2"));
  EXPECT_TRUE(begins(
      mistakes_of(traffic("max_geometries: 1", 2,
                          "        lorry: {position: [0 m, 0 m], speed: 1 m/s, size: [9 m, 2 m, 3 m]}\n")),
      "scenario.yaml:4:13: module traffic: 2 different shapes so far, but world.max_geometries is 1"));
}

TEST_F(WorldWiring, LayersAreThoseOfTheBodiesUnlessListed) {
  const std::string vehicles =
      "tasks:\n  - module: traffic\n    type: vehicles\n    rate: 1 kHz\n    parameters: {vehicles: {a: "
      "{position: [0 m, 0 m], speed: 1 m/s}, b: {position: [9 m, 0 m], speed: 1 m/s}}}\n"
      "  - module: crash\n    type: collision\n    rate: 1 kHz\n    parameters: {body: traffic.a, against: [";
  EXPECT_EQ(mistakes_of("scenario: a\nworld: {entities: [{name: e, shape: {sphere: 1 m}}]}\n" + vehicles +
                        "vehicle, static]}\n"),
            "");
  EXPECT_EQ(wiring_->layers.names(), (std::vector<std::string>{"static", "vehicle"}));
  EXPECT_TRUE(begins(mistakes_of("scenario: a\n" + vehicles + "car]}\n"),
                     "scenario.yaml:10:45: there is no layer 'car'; known here: vehicle"));
  EXPECT_EQ(
      mistakes_of("scenario: a\nworld: {layers: [ground]}\n" + vehicles + "ground]}\n"),
      "scenario.yaml:7:17: module traffic has bodies in the layer 'vehicle', which world.layers does not "
      "list; known here: ground\nscenario.yaml:11:45: module crash searches 'ground', where there is no "
      "other "
      "body, so it could never find one\n");
}

TEST_F(WorldWiring, MaterialsThatModulesNameAreThoseOfTheWorld) {
  const auto car = [](const std::string& material) {
    return "scenario: a\nworld: {materials: [{name: paint}]}\ntasks:\n  - module: traffic\n    type: "
           "vehicles\n"
           "    rate: 1 kHz\n    parameters: {vehicles: {a: {position: [0 m, 0 m], speed: 1 m/s, material: " +
           material + "}}}\n";
  };
  EXPECT_EQ(mistakes_of(car("paint")), "");
  EXPECT_EQ(mistakes_of(car("pain")),
            "scenario.yaml:7:79: there is no material 'pain' in world.materials; did you mean 'paint'?\n");
}

TEST_F(WorldWiring, LampsOfVehiclesAreLightsOfTheWorld) {
  const auto car = [](const std::string& lamp) {
    return "scenario: a\nworld: {lights: [{name: bulb, kind: point, intensity: 1 cd}]}\ntasks:\n  - module: "
           "traffic\n    type: vehicles\n    rate: 1 kHz\n    parameters: {vehicles: {a: {position: [0 m, 0 "
           "m], "
           "speed: 1 m/s" +
           lamp + "}}}\n";
  };
  EXPECT_EQ(mistakes_of(car(", lamp: bulb")), "");
  EXPECT_EQ(diagnostics_.warnings().size(), 0U);
  EXPECT_NE(
      mistakes_of(car(", lamp: bulp")).find("there is no light 'bulp' in world.lights; did you mean 'bulb'?"),
      std::string::npos);
  mistakes_of(car(""));
  ASSERT_EQ(diagnostics_.warnings().size(), 1U);
  EXPECT_EQ(diagnostics_.warnings()[0].message, "no entity names the light 'bulb', so it lights nothing");
}

TEST_F(WorldWiring, AViewNeedsABody) {
  const std::string view = "views: [{name: v, position: [0 m, 0 m, 1 m], look_at: [1 m, 0 m, 0 m]}]";
  EXPECT_EQ(mistakes_of("scenario: a\nworld: {entities: [{name: e, shape: {sphere: 1 m}}], " + view + "}\n"),
            "");
  EXPECT_EQ(mistakes_of("scenario: a\nworld: {" + view + "}\n"),
            "scenario.yaml:2:24: the world has no bodies that a view could show\n");
}

TEST_F(WorldWiring, SweepIsAWholeNumberOfPeriods) {
  EXPECT_EQ(mistakes_of(scanner("100 Hz", "scan_rate: 0.5 Hz")), "");
  EXPECT_TRUE(begins(mistakes_of(scanner("100 Hz", "scan_rate: 33 Hz")),
                     "scenario.yaml:8:74: 'scan_rate': a sweep of 30303030 ns is not a whole number of the "
                     "task's periods of 10000000 ns; with 33.3333333333 Hz or 25 Hz it is"));
  EXPECT_EQ(mistakes_of(scanner("100 Hz", "scan_rate: 33.3333333333 Hz")), "")
      << "the suggested rate is accepted";
  EXPECT_TRUE(begins(mistakes_of(scanner("100 Hz", "scan_rate: 0.3 Hz")), "scenario.yaml:8:74: 'scan_rate'"));
  EXPECT_TRUE(begins(mistakes_of(scanner("1 Hz", "scan_rate: 2 Hz")), "scenario.yaml:8:74: 'scan_rate'"));
}

TEST_F(WorldWiring, AScannerOrACameraWithoutABodyToFindIsWarnedOf) {
  const auto warnings_of = [&](const std::string& type, const std::string& mask, const std::string& layers) {
    const std::string rest =
        type == "camera" ? "resolution: [16, 16], objects: 1, object_layers: " : "object_layers: ";
    mistakes_of(
        "scenario: a\nworld:\n  layers: [car, wall]\n  lights: [{name: l, kind: point, intensity: 1 "
        "cd}]\n  entities:\n    - {name: a, shape: {sphere: 1 m}, mask: [wall], light: l}\n"
        "    - {name: b, shape: {sphere: 1 m}, mask: [" +
        mask + "]}\ntasks:\n  - {module: m, type: " + type +
        ", rate: 1 Hz, parameters: {carrier: a, layers: [car, wall], " + rest + layers + "}}\n");
    std::size_t count = 0;
    for (const config::Mistake& warning : diagnostics_.warnings())
      count += warning.message.find("where there is no other body") != std::string::npos ? 1 : 0;
    return count;
  };
  for (const char* const type : {"laser_scanner", "camera"}) {
    EXPECT_EQ(warnings_of(type, "car", "[wall]"), 1U) << type << ": the carrier is not found";
    EXPECT_EQ(warnings_of(type, "car", "[car]"), 0U) << type << diagnostics_.to_text();
    EXPECT_EQ(warnings_of(type, "wall", "[wall]"), 0U) << type;
    EXPECT_EQ(warnings_of(type, "wall", "[car]"), 1U) << type;
  }
}

TEST_F(WorldWiring, BeamsOfAStepAreLimited) {
  EXPECT_EQ(mistakes_of(scanner("1 Hz", "columns: 2048, rows: 2048")), "");
  EXPECT_TRUE(begins(
      mistakes_of(scanner("1 Hz", "columns: 16384, rows: 8192")),
      "scenario.yaml:8:72: a sweep of 134217728 beams has 134217728 in a step of the task; at most 4194304"));
  EXPECT_TRUE(
      begins(mistakes_of(scanner("0.5 Hz", "scan_rate: 0.5 Hz")),
             "scenario.yaml:8:74: the beams of a step leave within the task's period of 2000000000 ns"));
  EXPECT_EQ(mistakes_of(scanner("0.5 Hz", "scan_rate: 0.5 Hz, ignore_motion: true")), "");
}

TEST_F(WorldWiring, ScannerIsNotComparedWithItsCarrier) {
  EXPECT_EQ(mistakes_of(scanner("100 Hz", "compare: [a]")),
            "scenario.yaml:8:73: 'compare': 'a' carries the scanner, so its beams do not sweep over it\n");
}

TEST_F(WorldWiring, DetectorsNeedALoop) {
  EXPECT_EQ(
      mistakes_of("scenario: a\nworld: {layers: [car]}\ntasks:\n  - module: loops\n    type: detectors\n"
                  "    rate: 50 Hz\n    parameters: {layers: [car], loops: {}}\n"),
      "scenario.yaml:7:40: 'loops': 0 loops; from 1 to 65535 are possible\n");
}

/// Extent of an outline: smallest and largest x, then y.
std::array<double, 4> extents(const report::Shape& shape) {
  std::array<double, 4> box{1e9, -1e9, 1e9, -1e9};
  for (const report::PointM& p : shape.footprint)
    box = {std::min(box[0], p.x_m), std::max(box[1], p.x_m), std::min(box[2], p.y_m),
           std::max(box[3], p.y_m)};
  return box;
}

void expect_extents(const report::Shape& shape, const std::array<double, 4>& expected) {
  const std::array<double, 4> box = extents(shape);
  for (std::size_t i = 0; i < box.size(); ++i)
    EXPECT_NEAR(box[i], expected[i], 1e-6) << shape.label << ' ' << i;
}

TEST_F(WorldWiring, OutlinesShowTheBodiesAtTheGivenTime) {
  ASSERT_EQ(mistakes_of(R"(
scenario: a
world:
  layers: [ground, thing]
  entities:
    - {name: mover, shape: {box: [4 m, 2 m, 1 m]}, position: [-10 m, 0 m, 1 m], velocity: [10 m/s, 0 m/s, 0 m/s], mask: [thing]}
    - {name: spinner, shape: {box: [10 m, 1 m, 1 m]}, angular_velocity: [0 deg/s, 0 deg/s, 45 deg/s], mask: [ground]}
    - {name: pitched, shape: {box: [10 m, 1 m, 2 m]}, rotation: {pitch: 90 deg}, position: [-10 m, -10 m, 6 m], mask: [thing]}
    - {name: lying, shape: {cylinder: {radius: 1 m, height: 6 m}}, scale: 2, rotation: {pitch: 90 deg}, mask: [thing]}
    - {name: ball, shape: {sphere: 1 m}, rotation: {pitch: 90 deg}, scale: 3, mask: [thing]}
)"),
            "");
  const auto shapes = outlines(*scenario_, wiring_->scenery, first_motions(scenario_->world), 2'000'000'000);
  ASSERT_EQ(shapes.size(), 5U);
  expect_extents(shapes[0], {8.0, 12.0, -1.0, 1.0});
  expect_extents(shapes[1], {-0.5, 0.5, -5.0, 5.0});
  expect_extents(shapes[2], {-11.0, -9.0, -10.5, -9.5});
  expect_extents(shapes[3], {-6.0, 6.0, -2.0, 2.0});
  expect_extents(shapes[4], {-3.0, 3.0, -3.0, 3.0});
  EXPECT_EQ(shapes[0].footprint.size(), 4U);
  EXPECT_EQ(shapes[0].body_layer, "thing");
  EXPECT_EQ(shapes[0].layer, report::Layer::structure) << "the layer of the picture";
  EXPECT_EQ(shapes[1].body_layer, "ground");
}

TEST_F(WorldWiring, EntityWithoutAShapeIsNoBody) {
  const std::string world =
      "scenario: a\nworld:\n  lights: [{name: lamp, kind: point, intensity: 1 cd}]\n"
      "  entities: [{name: a, shape: {sphere: 1 m}}, {name: bulb, light: lamp}, "
      "{name: b, shape: {box: [1 m, 1 m, 1 m]}}]\n";
  EXPECT_EQ(mistakes_of(world), "");
  EXPECT_EQ(wiring_->scenery.mesh_of, (std::vector<std::optional<std::size_t>>{0, {}, 1}));
  const auto motions = first_motions(wiring_->scenario->world);
  EXPECT_EQ(motions.size(), 3U);
  const auto shapes = outlines(*wiring_->scenario, wiring_->scenery, motions, 0);
  ASSERT_EQ(shapes.size(), 2U) << "a light has no outline";
  EXPECT_EQ(shapes[1].label, "b");
  EXPECT_EQ(
      mistakes_of(world + "variables: {d: 'distance(a, bulb)'}\n"),
      "scenario.yaml:5:29: the entity 'bulb' has no shape; only bodies with a shape can be named here\n");
  EXPECT_EQ(
      mistakes_of(world + "tasks: [{module: m, type: free_body, rate: 100 Hz, parameters: {body: bulb, "
                          "mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2]}}]\n"),
      "scenario.yaml:5:71: the entity 'bulb' has no shape; only bodies with a shape can be named here\n");
}

TEST_F(WorldWiring, BodyIsMovedByOneModule) {
  const auto free_bodies = [](const std::string& first, const std::string& second) {
    std::string text = "scenario: a\nworld: {entities: [{name: capsule, shape: {sphere: 1 m}}]}\ntasks:\n";
    for (const auto& [module, body] : {std::pair("one", first), std::pair("two", second)}) {
      text += std::string("  - module: ") + module + "\n    type: free_body\n    rate: 100 Hz\n" +
              "    parameters: {body: " + body + ", mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2]}\n";
    }
    return text;
  };
  EXPECT_EQ(mistakes_of(free_bodies("capsule", "capsule")),
            "scenario.yaml:11:24: module one moves 'capsule' already; a body is moved by one module\n");
  EXPECT_EQ(mistakes_of(free_bodies("capsule", "capsul")),
            "scenario.yaml:11:24: there is no entity 'capsul' in world.entities; did you mean 'capsule'?\n");
}

}  // namespace
}  // namespace hil::run
