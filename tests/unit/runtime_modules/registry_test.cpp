// The module types, and the ports that modules declare before there is a world.

#include "runtime/modules/registry.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include <hil/module.hpp>

#include "runtime/config/parse.hpp"

namespace hil::modules {
namespace {

std::unique_ptr<AnyModule> create(const std::string& type, const std::string& yaml,
                                  config::Diagnostics& diagnostics) {
  const ModuleType* found = find_module_type(type);
  if (found == nullptr) return nullptr;
  const auto parameters = config::parse_text("test.yaml", yaml, found->parameters, diagnostics);
  return parameters ? found->create(*parameters, {.instance = "test", .period_ns = 10'000'000}, diagnostics)
                    : nullptr;
}

std::set<std::string> names(const std::vector<Port>& ports) {
  std::set<std::string> result;
  for (const Port& port : ports)
    result.insert(port.name);
  return result;
}

const char* const two_vehicles = R"(
vehicles:
  ego: {position: [-20 m, -1.75 m], speed: 36 km/h, light: east, stop_line: 10 m, braked_from_outside: true}
  other: {position: [3 m, 4 m], heading: 90 deg, speed: 5 m/s, light: east, stop_line: 10 m}
)";
const char* const scanner = "{carrier: ego, layers: [a], object_layers: [a], max_objects: 2}";
const char* const camera = "{carrier: ego, layers: [a], object_layers: [a], objects: 2}";
const char* const detectors =
    "{layers: [a], loops: {near: {center: [0 m, 0 m, 0 m], size: [1 m, 1 m, 1 m]}, "
    "far: {center: [9 m, 0 m, 0 m], size: [1 m, 1 m, 1 m]}}}";
const char* const free_body = "{body: a, mass: 12 t, inertia: [50 t m2, 60 t m2, 60 t m2]}";
const char* const rigid_bodies =
    "{bodies: [{body: a}, {body: b, mass: 1 kg, inertia: {sphere: {radius: 1 m}}}], stiffness: 1 kN/m, "
    "damping: 1 N s/m}";
const char* const block = "{inputs: {u: m}, states: {x: {initial: 1 m}}}";
const char* const collision = "{body: ego, against: [a]}";

TEST(Registry, FindsEveryTypeByItsName) {
  std::set<std::string> seen;
  for (const ModuleType& type : module_types()) {
    EXPECT_TRUE(seen.insert(type.name).second) << type.name << " is there twice";
    EXPECT_EQ(find_module_type(type.name), &type);
    EXPECT_FALSE(type.about.empty()) << type.name;
  }
  const std::set<std::string> folders{
#define MODULE(folder) #folder,
#include "runtime/modules/table.def"
#undef MODULE
  };
  EXPECT_EQ(seen, folders) << "a type has the name of its folder";
  EXPECT_EQ(find_module_type("laser"), nullptr);
  EXPECT_EQ(find_module_type(""), nullptr);
}

TEST(Registry, EveryModuleDescribesItsPorts) {
  const std::map<std::string, const char*> parameters{
      {"vehicles", two_vehicles}, {"laser_scanner", scanner},  {"detectors", detectors},
      {"collision", collision},   {"free_body", free_body},    {"rigid_bodies", rigid_bodies},
      {"block", block},           {"spatial_relations", "{}"}, {"camera", camera}};
  for (const ModuleType& module_type : module_types()) {
    const std::string type(module_type.name);
    ASSERT_TRUE(parameters.contains(type)) << "add example parameters of the module type " << type;
    config::Diagnostics diagnostics;
    const auto module = create(type, parameters.at(type), diagnostics);
    ASSERT_NE(module, nullptr) << type << "\n" << diagnostics.to_text();
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.to_text();
    const Ports& ports = module->ports();
    EXPECT_EQ(names(ports.inputs).size(), ports.inputs.size()) << type;
    EXPECT_EQ(names(ports.outputs).size(), ports.outputs.size()) << type;
    // Its outputs are the relations that expressions read, of which there are none here.
    EXPECT_EQ(ports.outputs.empty(), !module_type.computes.empty()) << type;
    for (const auto* side : {&ports.inputs, &ports.outputs}) {
      for (const Port& port : *side)
        EXPECT_FALSE(port.about.empty()) << type << "." << port.name;
    }
  }
}

TEST(Registry, VehiclesShareALightAndStartAtTheirPositions) {
  config::Diagnostics diagnostics;
  const auto module = create("vehicles", two_vehicles, diagnostics);
  ASSERT_NE(module, nullptr) << diagnostics.to_text();
  const Ports& ports = module->ports();
  ASSERT_EQ(ports.inputs.size(), 4U);
  EXPECT_EQ(ports.inputs[0].name, "light_east");
  EXPECT_TRUE(ports.inputs[0].required);
  EXPECT_EQ(ports.inputs[1].name, "ego_brake_request");
  EXPECT_EQ(ports.inputs[1].unit, "m/s2");
  EXPECT_FALSE(ports.inputs[1].required);
  EXPECT_EQ(ports.inputs[2].name, "ego.desired_speed");
  EXPECT_EQ(ports.inputs[2].unit, "m/s");
  EXPECT_FALSE(ports.inputs[2].required);
  EXPECT_EQ(ports.inputs[3].name, "other.desired_speed");
  for (const Port& port : ports.outputs) {
    if (port.name == "ego.x") {
      EXPECT_DOUBLE_EQ(port.initial, -20.0);
    }
    if (port.name == "ego.speed") {
      EXPECT_DOUBLE_EQ(port.initial, 10.0);
    }
  }
  EXPECT_EQ(names(ports.outputs).count("other.yaw_rate"), 1U);
}

TEST(Registry, VehiclesThatCanNotDriveAreMistakesWithTheirPlaces) {
  config::Diagnostics diagnostics;
  create("vehicles",
         "vehicles:\n"
         "  parked: {position: [0 m, 0 m], speed: 0 m/s}\n"
         "  blind: {position: [9 m, 0 m], speed: 5 m/s, light: east}\n",
         diagnostics);
  ASSERT_EQ(diagnostics.count(), 2U) << diagnostics.to_text();
  EXPECT_EQ(diagnostics.mistakes()[0].place.line, 2U);
  EXPECT_NE(diagnostics.mistakes()[0].message.find("'parked' has speed 0 at the start"), std::string::npos);
  EXPECT_EQ(diagnostics.mistakes()[1].place.line, 3U);
  EXPECT_NE(diagnostics.mistakes()[1].message.find("'blind' has a light but no stop_line"),
            std::string::npos);
}

TEST(Registry, InertiaThatNoBodyHasIsAMistakeAtItsPlace) {
  const std::pair<const char*, const char*> bad[] = {
      {"[1 kg m2, 1 kg m2, 3 kg m2]", "one principal moment is larger than the sum of the other two"},
      {"[1 kg m2, 1 kg m2, 1 kg m2, 2 kg m2, 0 kg m2, 0 kg m2]", "not positive definite"},
      {"[1e-300 kg m2, 1e-300 kg m2, 1e-300 kg m2]", "each has to be at least 1e-12 kg m2"},
      {"[1 kg m2, 1 kg m2, 1 kg m2, 0 kg m2]", "'inertia' has 4 numbers"}};
  for (const auto& [inertia, message] : bad) {
    config::Diagnostics diagnostics;
    EXPECT_EQ(create("free_body", std::string("body: a\nmass: 1 kg\ninertia: ") + inertia, diagnostics),
              nullptr);
    ASSERT_EQ(diagnostics.count(), 1U) << diagnostics.to_text();
    EXPECT_EQ(diagnostics.mistakes()[0].place.line, 3U);
    EXPECT_NE(diagnostics.mistakes()[0].message.find(message), std::string::npos) << diagnostics.to_text();
  }
}

TEST(Registry, ScannerHasFourOutputsForEachTarget) {
  config::Diagnostics diagnostics;
  const auto module =
      create("laser_scanner", "{carrier: ego, layers: [a], object_layers: [a], max_objects: 2, targets: 3}",
             diagnostics);
  ASSERT_NE(module, nullptr) << diagnostics.to_text();
  EXPECT_EQ(module->ports().outputs.size(), 2U * 7U + 4U + 1U + 3U * 4U);
  for (const char* name :
       {"target_count", "target0.azimuth", "target1.elevation", "target2.range", "target2.intensity"})
    EXPECT_EQ(names(module->ports().outputs).count(name), 1U) << name;
}

TEST(Registry, ScannerParametersThatContradictOneAnotherAreMistakes) {
  const auto mistakes = [](const std::string& more) {
    config::Diagnostics diagnostics;
    const auto module = create(
        "laser_scanner", "{carrier: ego, layers: [a], object_layers: [a], scan_rate: 10 Hz, " + more + "}",
        diagnostics);
    EXPECT_EQ(module == nullptr, !diagnostics.empty());
    return diagnostics.to_text();
  };
  const auto has = [&](const std::string& more, const std::string& sentence) {
    const std::string text = mistakes(more);
    EXPECT_NE(text.find(sentence), std::string::npos) << text;
  };
  EXPECT_EQ(mistakes("point_cloud: {rate: 10 Hz}"), "");
  EXPECT_EQ(mistakes("point_cloud: {rate: 2.5 Hz}"), "");
  has("point_cloud: {rate: 20 Hz}", "20 Hz is above 'scan_rate': a cloud is one sweep");
  has("point_cloud: {rate: 4 Hz}", "the nearest rates are 3.33333333333 Hz and 5 Hz");
  has("point_cloud: {rate: 10 Hz}, columns: 16384, rows: 8192, returns: 2",
      "a sweep has up to 268435456 returns; at most 4194304 are possible");
  has("divergence: 1 deg, compare: [car]", "'compare' measures with rays; it needs a divergence of 0 deg");
  has("returns: 9", "out of range");
  has("divergence: 91 deg", "out of range");
  has("divergence: -1 deg", "out of range");
  has("targets: 9", "out of range");
  has("threshold: -1", "out of range");
  has("range_noise: -1 mm", "out of range");
}

TEST(Registry, ScannerHasSevenOutputsForEachObject) {
  config::Diagnostics diagnostics;
  const auto module = create("laser_scanner", scanner, diagnostics);
  ASSERT_NE(module, nullptr) << diagnostics.to_text();
  EXPECT_EQ(module->ports().outputs.size(), 2U * 7U + 4U);
  EXPECT_EQ(names(module->ports().outputs).count("object1.age"), 1U);
  EXPECT_EQ(names(module->ports().outputs).count("object2.age"), 0U);
}

}  // namespace
}  // namespace hil::modules
