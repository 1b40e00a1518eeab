// Runs of scenarios whose modules are blocks: they open no GPU, and two of them are alike.

#include <gtest/gtest.h>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

constexpr const char* block_plant = R"(
base_rate: 1 kHz
variables: {limit: 1.5 m, margin: limit - tank.level}
tasks:
  - module: tank
    type: block
    rate: 1 kHz
    inputs: {pump: control.pump}
    parameters:
      parameters: {area: 0.25 m2, outlet: 4 cm2}
      inputs: {pump: "%"}
      states:
        level: {initial: 0.5 m, derivative: (inflow - drain) / area, min: 0, max: 2 m}
      variables:
        inflow: pump * 6 l/s
        drain: outlet * sqrt(2 * gn * max(level, 0 m))
        gn: 9.81 m/s2
        measured: level + noise(1 mm)
)";
constexpr const char* block_scenario = R"(
scenario: tank
include: [plant.yaml]
clock: virtual
duration: 20 s
set: {variables.limit: 1.2 m}
tasks:
  - module: control
    type: block
    rate: 100 Hz
    inputs: {level: tank.measured}
    parameters:
      inputs: {level: mm}
      states: {pump: {initial: 0, unit: "%"}}
      state_machines:
        mode:
          states:
            idle: {entry: {pump: 0}, transitions: [{to: filling, when: level < 600 mm, after: 1 s}]}
            filling: {entry: {pump: 80}, transitions: [{to: idle, when: level > 700 mm}]}
expectations:
  - {name: no overflow, always: margin > 0}
  - {name: fills, eventually: control.mode == filling and tank.level > 65 cm, by: 15 s}
)";

struct BlockScenario {
  BlockScenario() {
    write_text(folder / "plant.yaml", block_plant);
    write_text(folder / "tank.yaml", block_scenario);
  }
  Ended run(const std::string& out, const std::vector<std::string>& more = {},
            const Environment& environment = {}) const {
    return run_hil(joined({{"run", folder / "tank.yaml", "--out", folder / out}, more}), environment);
  }
  Folder folder;
};

TEST(BlockScenarios, OpenNoGpu) {
  const BlockScenario files;
  const Ended ended = files.run("out", {}, {{"VK_DRIVER_FILES", "/none"}, {"VK_ICD_FILENAMES", "/none"}});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(report["gpu"]["device"], "");
  EXPECT_FALSE(std::filesystem::exists(files.folder / "out/database"));
  EXPECT_FALSE(std::filesystem::exists(files.folder / "out/world.json"));
  EXPECT_EQ(read_text(files.folder / "out/report.html").find("GPU"), std::string::npos);
  const Ended history = run_hil({"history", files.folder / "out", "info"});
  EXPECT_NE(history.errors.find("holds no log of a database: the run opened no database"), std::string::npos)
      << history.errors;
}

TEST(BlockScenarios, AreByteForByteAlike) {
  const BlockScenario files;
  ASSERT_EQ(files.run("one").code, 0);
  ASSERT_EQ(files.run("two").code, 0);
  ASSERT_EQ(files.run("other", {"--seed", "2"}).code, 0);
  const std::string signals = read_text(files.folder / "one/signals.csv");
  EXPECT_EQ(signals, read_text(files.folder / "two/signals.csv"));
  EXPECT_NE(signals, read_text(files.folder / "other/signals.csv")) << "the noise is of the seed";
  EXPECT_NE(signals.find("tank.measured"), std::string::npos);
  EXPECT_NE(signals.find("limit,margin"), std::string::npos);
}

TEST(BlockScenarios, TransitionsAreEventsAtTheirInstants) {
  const BlockScenario files;
  ASSERT_EQ(files.run("out").code, 0);
  const auto events = read_report(files.folder / "out")["events"];
  ASSERT_GE(events.size(), 3U);
  EXPECT_EQ(events[0]["text"], "control.mode is idle");
  EXPECT_EQ(events[0]["time_ns"], 0);
  EXPECT_EQ(events[1]["text"], "control.mode is filling");
  EXPECT_EQ(events[1]["time_ns"], 1'000'000'000);
}

TEST(BlockScenarios, OfTheGuidePass) {
  for (const char* const name : {"plants.md", "stimuli_and_faults.md"}) {
    const std::string page = read_text(std::string(HIL_SOURCE_DIR) + "/docs/guide/" + name);
    const std::string begin = "```yaml\n";
    const std::size_t first = page.find(begin) + begin.size();
    const Folder folder;
    write_text(folder / "tank.yaml", page.substr(first, page.find("```", first) - first));
    const Ended ended = run_hil({"run", folder / "tank.yaml", "--out", folder / "out"});
    EXPECT_EQ(ended.code, 0) << name << ended.output << ended.errors;
    const auto report = read_report(folder / "out");
    EXPECT_EQ(report["expectations"][0]["result"], "held") << name;
  }
}

TEST(BlockScenarios, WhoseValueIsUnknownDoNotPass) {
  const BlockScenario files;
  const Ended ended = files.run(
      "out",
      {"--set", "tasks.tank.parameters.variables.inflow=if time < 1.5 s then pump * 6 l/s else 1 m3/s / 0"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(report["expectations"][0]["result"], "not_checked") << report["expectations"].dump(1);
  EXPECT_NE(report["events"].dump().find("tank.level is unknown from here on"), std::string::npos);
}

TEST(BlockScenarios, ReadTablesFromFilesBesideThem) {
  const Folder folder;
  std::filesystem::create_directory(folder / "plant");
  write_text(folder / "plant/pump.csv", "opening,flow\n0,0\n50,2\n100,10\n");
  write_text(folder / "plant/torque.csv", "pedal/speed,0,1000\n0,0,0\n100,50,200\n");
  write_text(folder / "plant/plant.yaml", R"yaml(
tasks:
  - module: p
    type: block
    rate: 10 Hz
    parameters:
      tables:
        pump: {file: pump.csv, x: "%", unit: l/s}
        torque: {file: torque.csv, x: rpm, y: "%", unit: N m}
      variables:
        flow: {value: pump(time * 100 %/s), unit: l/s}
        moment: torque(500 rpm, time * 100 %/s)
)yaml");
  write_text(folder / "s.yaml", R"(
scenario: files
include: plant/plant.yaml
clock: virtual
base_rate: 10 Hz
duration: 1.1 s
expectations:
  - {name: bend, always: abs(p.flow - 2 l/s) < 1 ml/s, between: [500 ms, 500 ms]}
)");
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const Signals signals(folder / "out");
  ASSERT_EQ(signals["p.flow"].size(), 11U);
  for (std::size_t i = 0; i < 11; ++i) {
    const double opening = 10.0 * static_cast<double>(i);
    EXPECT_NEAR(signals["p.flow"][i], opening <= 50.0 ? opening / 25.0 : 2.0 + (opening - 50.0) * 0.16, 1e-9);
    EXPECT_NEAR(signals["p.moment"][i], 1.25 * opening, 1e-9);
  }
  write_text(folder / "plant/torque.csv", "pedal/speed,0,1000\n0,0,0\n100,,200\n");
  const Ended refused = run_hil({"check", folder / "s.yaml"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.errors.find("plant/torque.csv:3:5: an empty cell: a number is missing"),
            std::string::npos)
      << refused.errors;
}

}  // namespace
}  // namespace hil::scenario_test
