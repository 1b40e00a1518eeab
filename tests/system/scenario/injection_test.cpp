// Stimuli and faults in runs: their events, their records, and the verdict.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

constexpr const char* injection_scenario = R"(
scenario: tank with faults
clock: virtual
base_rate: 1 kHz
duration: 6 s
tasks:
  - module: tank
    type: block
    rate: 1 kHz
    parameters:
      inputs: {inflow: {unit: l/s, initial: 0}}
      states: {level: {initial: 1 m, derivative: (inflow - 1 l/s) / 0.04 m2, min: 0, max: 3 m}}
  - module: plc
    type: block
    rate: 100 Hz
    inputs: {level: tank.level}
    parameters:
      inputs: {level: mm}
      outputs: {trip: level > 1300 mm}
stimuli:
  - name: filling
    drives: tank.inflow
    sequence:
      - {hold: 1 l/s, for: 1 s}
      - {name: surge, ramp: 21 l/s, for: 2 s}
      - {noise: {mean: 5 l/s, deviation: 1 l/s}}
faults:
  - {name: stuck, signal: tank.level, stuck: last, at: 2 s, for: 3 s}
expectations:
  - {name: trips, eventually: plc.trip == 1, by: 5.1 s}
  - {name: late, never: plc.trip == 1 and time < 5 s}
  - {name: true_level, eventually: tank.level > 1.5 m and fault.stuck == 1}
)";

struct InjectionScenario : ScenarioFolder {
  InjectionScenario() : ScenarioFolder(injection_scenario) {}
};

TEST(Injection, BeginsAndEndsAreEventsAtTheirInstants) {
  const InjectionScenario files;
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(events_in_ms(report),
            "0 stimulus filling begins\n"
            "1000 stimulus filling: surge begins\n"
            "2000 fault stuck begins: tank.level stuck at its last value\n"
            "5000 fault stuck ends\n");
  const auto& fault = report["faults"][0];
  EXPECT_EQ(fault["name"], "stuck");
  EXPECT_EQ(fault["begins"], 1);
  EXPECT_EQ(fault["first_begin_ns"], 2'000'000'000);
  EXPECT_EQ(fault["active_ns"], 3'000'000'000);
  EXPECT_EQ(report["stimuli"][0]["active_ns"], 6'000'000'000);
  const std::string page = read_text(files.folder / "out/report.html");
  EXPECT_NE(page.find("stuck at its last value"), std::string::npos);
}

TEST(Injection, EventsThatAreNotListedAreCounted) {
  const InjectionScenario files;
  const Ended ended = files.run("out", {"--set", "faults.stuck.at=0 s", "--set", "faults.stuck.for=1 ms",
                                        "--set", "faults.stuck.every=2 ms", "--set", "expectations=[]"});
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(files.folder / "out");
  // 3000 begins and ends of the fault, the begin of the stimulus, and of its part.
  EXPECT_EQ(report["events"].size(), 4096U);
  EXPECT_EQ(report["events_not_listed"], 6002 - 4096);
  const std::string sentence =
      "the first 4096 events of modules, stimuli and faults are listed, and 1906 more are not";
  EXPECT_NE(ended.output.find("  " + sentence), std::string::npos) << ended.output;
  EXPECT_EQ(ended.output.find("degraded: the event"), std::string::npos) << ended.output;
  EXPECT_NE(read_text(files.folder / "out/run.log").find(sentence), std::string::npos);
  EXPECT_EQ(report["realtime"]["degraded"].dump().find("event"), std::string::npos);
}

TEST(Injection, RecordsTheTrueAndTheFaultyValue) {
  const InjectionScenario files;
  ASSERT_EQ(files.run("out").code, 0);
  const std::string signals = read_text(files.folder / "out/signals.csv");
  EXPECT_NE(signals.substr(0, signals.find('\n')).find("tank.level.faulted"), std::string::npos);
}

TEST(Injection, RunsAreByteForByteAlike) {
  const InjectionScenario files;
  ASSERT_EQ(files.run("one").code, 0);
  ASSERT_EQ(files.run("two").code, 0);
  EXPECT_EQ(read_text(files.folder / "one/signals.csv"), read_text(files.folder / "two/signals.csv"));
}

TEST(Injection, ThatNeverBeganIsNotChecked) {
  const InjectionScenario files;
  const Ended ended =
      files.run("out", {"--set", "faults.stuck.signal=tank.level", "--set", "faults.stuck.at=5.9 s", "--set",
                        "faults.stuck.probability=0.0001 %", "--set", "expectations.trips.by=6 s", "--set",
                        "expectations.late.never=time > 1 h and plc.trip == 1", "--set",
                        "expectations.true_level.eventually=tank.level > 1 m"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("fault 'stuck' never began"), std::string::npos) << ended.output;
}

}  // namespace
}  // namespace hil::scenario_test
