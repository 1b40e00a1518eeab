// The module types of the plug-in docking, before there is a world.

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>
#include <utility>

#include "configs/docking/modules/docking.hpp"
#include "runtime/config/parse.hpp"

namespace hil::modules {
namespace {

std::unique_ptr<AnyModule> create(const ModuleType& type, const std::string& yaml,
                                  config::Diagnostics& diagnostics) {
  const auto parameters = config::parse_text("test.yaml", yaml, type.parameters, diagnostics);
  return parameters ? type.create(*parameters, {.instance = "test", .period_ns = 10'000'000}, diagnostics)
                    : nullptr;
}

const char* const docking_port =
    "{target: {body: a, axis: [0, -1, 0]}, chaser: {body: b, position: [2 m, 0 m, 0 m]}}";
const char* const pixel_study =
    "{port: {body: a}, reflector: b, reflector_size: 4 mm, distances: [20 m], samples: [16, 1], "
    "beams: [0.02 deg], layers: [x]}";
TEST(DockingModules, DescribeTheirPorts) {
  for (const auto& [type, parameters] :
       {std::pair{docking_port_type(), docking_port}, std::pair{pixel_study_type(), pixel_study}}) {
    config::Diagnostics diagnostics;
    const auto module = create(type, parameters, diagnostics);
    ASSERT_NE(module, nullptr) << type.name << diagnostics.to_text();
    EXPECT_FALSE(type.about.empty());
    const Ports& ports = module->ports();
    EXPECT_FALSE(ports.outputs.empty());
    for (const auto* side : {&ports.inputs, &ports.outputs}) {
      std::set<std::string> names;
      for (const Port& port : *side) {
        EXPECT_TRUE(names.insert(port.name).second) << type.name << "." << port.name;
        EXPECT_FALSE(port.about.empty()) << type.name << "." << port.name;
      }
    }
  }
}

TEST(DockingModules, StudyWhoseValuesDoNotFitTogetherIsAMistake) {
  const std::string whole =
      "port: {body: a}\nreflector: b\nreflector_size: 4 mm\ndistances: [20 m]\nlayers: [x]\n";
  const std::pair<const char*, const char*> bad[] = {
      {"samples: [15]", "15 samples are no square of whole numbers; the nearest one is 16"},
      {"samples: [4]\nneeded_shifts: 11", "'needed_shifts' is 11 of 10 'shifts'"},
      {"samples: [4, 16, 4]", "4 rays is given twice"},
      {"beams: [1 deg, 1.0000001 deg]", "beam of 1° is given twice"},
      {"samples: [4]\nrange: 19 m", "a distance of 20 m is beyond the 'range' of 19 m"},
      {"shifts: 9", "neither 'samples' nor 'beams'"}};
  for (const auto& [more, message] : bad) {
    config::Diagnostics diagnostics;
    EXPECT_EQ(create(pixel_study_type(), whole + more, diagnostics), nullptr);
    EXPECT_NE(diagnostics.to_text().find(message), std::string::npos) << diagnostics.to_text();
  }
}

TEST(DockingModules, StudyWithMoreImagesThanMemoryIsAMistake) {
  const std::string whole =
      "port: {body: a}\nreflector: b\nreflector_size: 4 mm\nlayers: [x]\npixels: 4096\nsamples: [1, 4, 9, "
      "16]\n"
      "distances: [";
  std::string distances = "1 m";
  for (int i = 2; i <= 33; ++i)
    distances += ", " + std::to_string(i) + " m";
  config::Diagnostics diagnostics;
  EXPECT_EQ(create(pixel_study_type(), whole + distances + "]", diagnostics), nullptr);
  EXPECT_NE(diagnostics.to_text().find("take 2214592512 bytes; at most 2147483648"), std::string::npos)
      << diagnostics.to_text();
  config::Diagnostics none;
  EXPECT_NE(create(pixel_study_type(), whole + distances + "]\nimages: false", none), nullptr)
      << none.to_text();
}

TEST(DockingModules, PortThatCanNotCaptureIsAMistake) {
  config::Diagnostics diagnostics;
  EXPECT_EQ(create(docking_port_type(), "{target: {body: a}, chaser: {body: a}}", diagnostics), nullptr);
  EXPECT_NE(diagnostics.to_text().find("'a' can not dock at itself"), std::string::npos);
  const auto fault_at = [](std::int64_t period_ns) {
    config::Diagnostics faults;
    const ModuleType type = docking_port_type();
    const auto parameters =
        config::parse_text("test.yaml", "{target: {body: a}, chaser: {body: b}, capture: {distance: 1 mm}}",
                           type.parameters, faults);
    type.create(*parameters, {.instance = "port", .period_ns = period_ns}, faults);
    return faults.to_text();
  };
  EXPECT_EQ(fault_at(10'000'000), "");
  EXPECT_NE(fault_at(50'000'000).find("the chaser moves by up to 5 mm in a step"), std::string::npos)
      << fault_at(50'000'000);
}

TEST(DockingModules, PortWithoutDirectionIsAMistake) {
  config::Diagnostics diagnostics;
  EXPECT_EQ(
      create(docking_port_type(), "{target: {body: a, axis: [0, 0, 0]}, chaser: {body: b}}", diagnostics),
      nullptr);
  ASSERT_EQ(diagnostics.count(), 1U) << diagnostics.to_text();
  EXPECT_NE(diagnostics.mistakes()[0].message.find("'axis' has no direction"), std::string::npos);
}

}  // namespace
}  // namespace hil::modules
