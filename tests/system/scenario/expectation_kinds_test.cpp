// One run with every kind of expectation: their results, margins and worst instants; two of them are alike.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// The level rises as 1 m * (1 - exp(-t / 0.5 s)) from 1 s on; the trip follows 5 ms later.
constexpr const char* kinds_scenario = R"(
scenario: every kind of expectation
clock: virtual
base_rate: 1 kHz
duration: 6 s
tasks:
  - module: tank
    type: block
    rate: 1 kHz
    parameters:
      inputs: {goal: {unit: m, initial: 0}}
      states: {level: {initial: 0 m, derivative: (goal - level) / 0.5 s}}
      outputs: {level: level, full: "if delay(level, 5 ms) > 0.9 m then 1 else 0"}
can:
  - bus: car
    device: virtual
    database: car.dbc
    rate: 100 Hz
    receive: [{message: Status, timeout: 100 ms}]
stimuli:
  - {name: step, drives: tank.goal, sequence: [{hold: 0 m, for: 1 s}, {hold: 1 m}]}
expectations:
  - {name: never, never: tank.level > 1.5 m}
  - {name: always, always: tank.level >= 0 m and tank.level <= 1.1 m, between: [2 s, 5 s]}
  - {name: eventually, eventually: tank.level > 0.5 m, by: 2 s}
  - {name: reaction, reaction: {when: tank.level > 0.9 m, then: tank.full == 1, within: 20 ms, for_at_least: 1 s}}
  - {name: count, count: {of: tank.full == 1, min: 1, max: 1}}
  - {name: order, order: [tank.level > 0.2 m, tank.level > 0.8 m, tank.full == 1]}
  - {name: tracks, tracks: {signal: tank.level, reference: level.csv, tolerance: 2 cm, after_shift: 50 ms}}
  - name: statistics
    statistics:
      signal: tank.level
      largest: {max: 1.05 m}
      overshoot: {of: 1 m, from: 0 m, at_most: 5 %}
      settling_time: {of: 1 m, from: 0 m, within: 2 %, at_most: 2 s}
    after: time >= 1 s and tank.goal > 0 m
  - {name: broken, always: tank.level < 0.5 m, between: [0 s, 4 s]}
  - {name: closed, never: tank.level > 0 m, after: tank.level > 3 m}
  - {name: silent, fresh: can.car.Status}
  - {name: no cycle, cycle_time: {message: can.car.Status, period: 10 ms, tolerance: 1 ms}}
)";
constexpr const char* car_database = R"(VERSION ""
BU_: HIL ECU
BO_ 768 Status: 8 ECU
 SG_ Mode : 0|4@1+ (1,0) [0|0] "" HIL
)";

struct KindsScenario {
  KindsScenario() {
    write_text(folder / "s.yaml", kinds_scenario);
    write_text(folder / "car.dbc", car_database);
    std::string csv = "time,level\n";
    for (int i = 0; i <= 600; ++i) {
      const double since_s = std::max(0.0, 0.01 * i - 1.02);  // 20 ms later than the signal
      csv += std::to_string(0.01 * i) + "," + std::to_string(1.0 - std::exp(-since_s / 0.5)) + "\n";
    }
    write_text(folder / "level.csv", csv);
  }
  Ended run(const std::string& out) const {
    return run_hil({"run", folder / "s.yaml", "--out", folder / out});
  }
  Folder folder;
};

TEST(ExpectationKinds, ReportTheirMarginsAndWorstInstants) {
  const KindsScenario files;
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  std::map<std::string, nlohmann::json> by_name;
  const auto report = read_report(files.folder / "out");
  for (const auto& expectation : report["expectations"])
    by_name[expectation["name"]] = expectation;
  const auto expect = [&](const char* name, const char* result, double margin, const char* unit,
                          std::int64_t worst_ms) {
    const auto& one = by_name.at(name);
    EXPECT_EQ(one["result"], result) << one.dump(1);
    ASSERT_TRUE(one["margin"].is_number()) << one.dump(1);
    EXPECT_NEAR(one["margin"].get<double>(), margin, 2e-3) << one.dump(1);
    EXPECT_EQ(one["margin_unit"], unit) << one.dump(1);
    if (worst_ms >= 0) {
      EXPECT_NEAR(one["worst_ns"].get<double>() * 1e-6, static_cast<double>(worst_ms), 1.5) << one.dump(1);
    }
  };
  const auto exponential = [](double since_s) { return 1.0 - std::exp(-since_s / 0.5); };
  expect("never", "held", 1.5 - exponential(5.0), "m", 5999);
  expect("always", "held", 1.1 - exponential(4.0), "m", 5000);
  expect("eventually", "held", 1.0 - 0.5 * std::log(2.0), "s", 1347);
  expect("reaction", "held", 0.015, "s", 2151);
  expect("count", "held", 0.0, "", 2156);
  EXPECT_EQ(by_name["order"]["result"], "held") << by_name["order"].dump(1);
  expect("tracks", "held", 0.02, "m", -1);
  EXPECT_NE(by_name["tracks"]["detail"].get<std::string>().find("after a shift of -"), std::string::npos)
      << by_name["tracks"].dump(1);
  expect("statistics", "held", 2.0 - 0.5 * std::log(50.0), "s", 2955);
  expect("broken", "failed", 0.5 - exponential(3.0), "m", 4000);
  EXPECT_NEAR(by_name["broken"]["first_failure_ns"].get<double>() * 1e-6, 1347, 1.5);
  EXPECT_EQ(by_name["closed"]["result"], "not_checked");
  EXPECT_TRUE(by_name["closed"]["margin"].is_null());
  EXPECT_EQ(by_name["closed"]["detail"], "its window did not open: 'tank.level > 3 m' was not true");
  EXPECT_EQ(by_name["silent"]["detail"], "fresh can.car.Status: it never arrived");
  EXPECT_EQ(by_name["no cycle"]["result"], "not_checked");
  EXPECT_NE(ended.output.find("; margin -"), std::string::npos) << ended.output;
  const std::string page = read_text(files.folder / "out/report.html");
  for (const char* column : {"Margin", "Worst at"})
    EXPECT_NE(page.find(column), std::string::npos) << column;
}

/// The controller sends one command for each object header.
constexpr const char* cycle_scenario = R"(
scenario: cycle times on a bus
clock: virtual
base_rate: 1 kHz
duration: 3 s
can:
  - bus: car
    device: virtual
    database: crossing.dbc
    rate: 1 kHz
    send:
      - {message: EgoStatus, period: 10 ms, counter: Counter, checksum: Checksum, signals: {Speed: 5, YawRate: 0}}
      - {message: ObjectHeader, period: 10 ms, counter: Counter, checksum: Checksum, signals: {ScanIndex: 1, ObjectCount: 0}}
    receive:
      - {message: BrakeCommand, timeout: 200 ms, counter: Counter, checksum: Checksum}
dut: {command: [hil-aeb-controller, --bus, "{can.car}", --database, crossing.dbc]}
expectations:
  - {name: right, cycle_time: {message: can.car.BrakeCommand, period: 10 ms, tolerance: 1 ms, at_least: 250}}
  - {name: wrong, cycle_time: {message: can.car.BrakeCommand, period: 20 ms, tolerance: 1 ms}}
  - {name: fresh, fresh: can.car.BrakeCommand, coverage: 99 %}
)";

TEST(ExpectationKinds, JudgeEveryFrameOfABus) {
  const Folder folder;
  write_text(folder / "s.yaml", cycle_scenario);
  std::filesystem::copy(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.dbc",
                        folder / "crossing.dbc");
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  const auto& expectations = report["expectations"];
  EXPECT_EQ(expectations[0]["result"], "held") << expectations[0].dump(1);
  EXPECT_EQ(expectations[0]["margin"], 0.001);
  EXPECT_EQ(expectations[1]["result"], "failed");
  EXPECT_EQ(expectations[1]["margin"], -0.009);
  EXPECT_EQ(expectations[2]["result"], "held") << expectations[2].dump(1);
  EXPECT_EQ(expectations[2]["margin"], 0.19) << "a frame each 10 ms, and 200 ms to its time-out";
}

constexpr const char* rates_scenario = R"(
scenario: two rates
clock: virtual
base_rate: 1 kHz
duration: 10 s
tasks:
  - {module: p, type: block, rate: RATE_P, parameters: {states: {x: {initial: 0 m, derivative: 1 m/s}}}}
  - {module: q, type: block, rate: RATE_Q, parameters: {states: {x: {initial: 0 m, derivative: 1 m/s}}}}
variables: {offset: 3 m, sum: p.x + q.x + offset, twice: 2 * sum, slope: derivative(sum)}
expectations:
  - {name: at once, always: abs(derivative(p.x + q.x) - 2 m/s) < 1 mm/s}
  - {name: by a variable, always: abs(derivative(sum) - 2 m/s) < 1 mm/s}
  - {name: by two, always: abs(derivative(twice) - 4 m/s) < 1 mm/s}
  - {name: in a variable, always: abs(slope - 2 m/s) < 1 mm/s}
)";

TEST(ExpectationKinds, SeeTheSlopeOfASumOfTwoRates) {
  const Folder folder;
  const std::vector<std::pair<std::string, std::string>> rates{
      {"100 Hz", "10 Hz"}, {"10 Hz", "100 Hz"}, {"1 kHz", "20 Hz"}, {"50 Hz", "50 Hz"}};
  for (const auto& [of_p, of_q] : rates) {
    std::string text = rates_scenario;
    text.replace(text.find("RATE_P"), 6, of_p);
    text.replace(text.find("RATE_Q"), 6, of_q);
    write_text(folder / "s.yaml", text);
    const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
    EXPECT_EQ(ended.code, 0) << of_p << ", " << of_q << ": " << ended.output << ended.errors;
  }
}

TEST(ExpectationKinds, AreJudgedAlikeInTwoRuns) {
  const KindsScenario files;
  files.run("one");
  files.run("two");
  auto one = read_report(files.folder / "one"), two = read_report(files.folder / "two");
  EXPECT_FALSE(one["expectations"].empty());
  EXPECT_EQ(one["expectations"].dump(), two["expectations"].dump());
  EXPECT_EQ(one["response_times"].dump(), two["response_times"].dump());
}

TEST(ExpectationKinds, OfTheGuideAreAccepted) {
  const std::string page = read_text(std::string(HIL_SOURCE_DIR) + "/docs/guide/expectations.md");
  const std::string begin = "```yaml\n";
  const KindsScenario files;
  int blocks = 0;
  for (std::size_t at = page.find(begin); at != std::string::npos; at = page.find(begin, at + 1)) {
    const std::size_t first = at + begin.size();
    std::string text = kinds_scenario;
    text.resize(text.find("expectations:"));
    write_text(files.folder / "s.yaml", text + page.substr(first, page.find("```", first) - first));
    const Ended ended = run_hil({"check", files.folder / "s.yaml"});
    EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
    ++blocks;
  }
  EXPECT_GE(blocks, 5);
}

}  // namespace
}  // namespace hil::scenario_test
