// Bodies that touch, as a user runs them: a run that repeats bit for bit, and mistakes with their places.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// Two boxes fall on a floor and on each other.
const char* const falling_boxes = R"(scenario: boxes
base_rate: 1 kHz
duration: 2 s
clock: virtual
world:
  entities:
    - {name: floor, shape: {box: [10 m, 10 m, 1 m]}, position: [0 m, 0 m, -0.5 m], mask: [fixed]}
    - {name: low, shape: {box: [1 m, 1 m, 1 m]}, position: [0 m, 0 m, 0.7 m], rotation: {roll: 20 deg}, mask: [box]}
    - {name: high, shape: {box: [1 m, 1 m, 1 m]}, position: [0.3 m, 0.2 m, 2 m], mask: [box]}
tasks:
  - module: boxes
    type: rigid_bodies
    rate: 250 Hz
    parameters:
      bodies:
        - {body: floor}
        - {body: low, mass: 10 kg, inertia: {box: [1 m, 1 m, 1 m]}}
        - {body: high, mass: 10 kg, inertia: {box: [1 m, 1 m, 1 m]}}
      stiffness: 400 kN/m
      damping: 800 N s/m
      margin: 20 mm
expectations:
  - {name: all contacts are known, never: boxes.undecided > 0 or boxes.overflows > 0 or boxes.late > 0}
  - {name: the boxes meet, eventually: boxes.touched == 2, by: 2 s}
)";

/// The scenario with a text replaced.
void write_boxes(const std::filesystem::path& file, const std::string& from = {},
                 const std::string& to = {}) {
  std::string text = falling_boxes;
  if (!from.empty()) {
    const std::size_t place = text.find(from);
    ASSERT_NE(place, std::string::npos) << from;
    text.replace(place, from.size(), to);
  }
  write_text(file, text);
}

TEST(RigidBodies, ARunRepeatsBitForBit) {
  const Folder folder;
  write_boxes(folder / "boxes.yaml");
  for (const char* name : {"first", "second"}) {
    const Ended run = run_hil({"run", folder / "boxes.yaml", "--out", folder / name});
    ASSERT_EQ(run.code, 0) << run.output << run.errors;
  }
  const std::string signals = read_text(folder / "first/signals.csv");
  EXPECT_GT(signals.size(), 10'000U);
  EXPECT_EQ(signals, read_text(folder / "second/signals.csv"));
  const auto history = [&](const char* run) { return run_hil({"db", "export", folder / run}).output; };
  EXPECT_GT(history("first").size(), 10'000U);
  EXPECT_EQ(history("first"), history("second"));
  const Signals values(folder / "first");
  EXPECT_LT(values["boxes.low.z"].back(), 0.75);
  EXPECT_NE(values["boxes.low.qw"].back(), 1.0) << "it has turned";
  const auto report = read_report(folder / "first");
  EXPECT_EQ(report["sections"].at(0)["tables"].at(0)["rows"].size(), 2U) << "pairs that touched";
}

struct BoxesMistake {
  const char *from, *to, *mistake;
};

TEST(RigidBodies, MistakesHaveTheirPlaces) {
  const BoxesMistake changes[] = {
      {"{body: low, mass: 10 kg", "{body: low, mass: 0 kg", ":17:29: 'mass': '0 kg' is out of range"},
      {"{body: low, mass", "{body: lwo, mass", ":17:18: there is no entity 'lwo' in world.entities"},
      {"{body: floor}", "{body: flor}", ":16:18: there is no body 'flor'; did you mean 'floor'?"},
      {"stiffness: 400 kN/m", "stiffness: 501 kN/m",
       ":19:18: 'stiffness' is 501000 N/m, but with a substep of 1 ms and 'low' and 'high' (reduced mass 5 "
       "kg) at most 500000 N/m (0.1 m / h^2) is stable"},
      {"damping: 800 N s/m", "damping: 1.1 kN s/m", ":20:16: 'damping' is 1100 N s/m"},
  };
  for (const BoxesMistake& change : changes) {
    const Folder folder;
    write_boxes(folder / "boxes.yaml", change.from, change.to);
    const Ended check = run_hil({"check", folder / "boxes.yaml"});
    EXPECT_EQ(check.code, 2) << check.output << check.errors;
    const std::string printed = check.output + check.errors;
    EXPECT_NE(printed.find("boxes.yaml" + std::string(change.mistake)), std::string::npos)
        << change.mistake << " is not in: " << printed;
  }
}

/// Whether a shape is closed is known when the database has it: the run is refused, with the place.
TEST(RigidBodies, AnOpenShapeIsRefused) {
  const Folder folder;
  write_boxes(folder / "boxes.yaml", "{box: [10 m, 10 m, 1 m]}", "{rectangle: [10 m, 10 m]}");
  const Ended run = run_hil({"run", folder / "boxes.yaml", "--out", folder / "out"});
  EXPECT_EQ(run.code, 2) << run.output << run.errors;
  const std::string printed = run.output + run.errors;
  EXPECT_NE(printed.find("boxes.yaml:16:18: 'floor' has an open shape"), std::string::npos) << printed;
}

}  // namespace
}  // namespace hil::scenario_test
