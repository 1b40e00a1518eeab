// configs/tank: a stuck level sensor, and the trip of the PLC.

#include <gtest/gtest.h>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

std::string tank_file(const std::string& name) {
  return std::string(HIL_SOURCE_DIR) + "/configs/tank/" + name;
}

std::int64_t time_of(const nlohmann::json& report, const std::string& event) {
  for (const auto& one : report["events"])
    if (one["text"].get<std::string>().starts_with(event)) return one["time_ns"];
  ADD_FAILURE() << "no event '" << event << "'";
  return 0;
}

TEST(Tank, TripStopsThePump) {
  const Folder folder;
  const Ended ended = run_hil({"run", tank_file("tank.yaml"), "--out", folder / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["gpu"]["device"], "") << "a tank needs no GPU";
  EXPECT_EQ(time_of(report, "fault stuck_sensor begins"), 3'000'000'000);
  EXPECT_NE(read_text(folder / "out/run.log").find("event at 3 s: fault stuck_sensor begins"),
            std::string::npos);
}

TEST(Tank, RunsAreByteForByteAlike) {
  const Folder folder;
  for (const char* const out : {"one", "two"})
    ASSERT_EQ(run_hil({"run", tank_file("tank.yaml"), "--out", folder / out}).code, 0);
  EXPECT_EQ(read_text(folder / "one/signals.csv"), read_text(folder / "two/signals.csv"));
}

TEST(Tank, WithoutTheTripFails) {
  const Folder folder;
  const Ended ended = run_hil({"run", tank_file("no_trip.yaml"), "--out", folder / "out"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("the trip stops the pump within 500 ms"), std::string::npos) << ended.output;
}

TEST(Tank, RunsInRealTime) {
  const Folder folder;
  const Ended ended = run_hil(joined(
      {{"run", tank_file("tank.yaml"), "--clock", "realtime", "--out", folder / "out"}, relaxed_timing()}));
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
}

/// The PLC is silent, cut off, slow, refuses, and stands still; the run keeps step with it.
TEST(Tank, PassesWithFaultsOfThePlc) {
  const Folder folder;
  write_text(folder / "s.yaml",
             "scenario: tank with a PLC that fails\ninclude: [" + tank_file("tank.yaml") + R"(]
faults:
  - {name: silent, device: modbus.plc, state: silent, at: 5 s, for: 2 s}
  - {name: cut, device: modbus.plc, state: disconnected, at: 8 s, for: 500 ms}
  - {name: slow, device: modbus.plc, delay: 100 ms, at: 10 s, for: 1 s}
  - {name: refusing, device: modbus.plc, exception: 6, at: 12 s, for: 500 ms}
  - {name: paused, process: plc, state: paused, at: 14 s, for: 300 ms}
)");
  for (const char* const out : {"one", "two"}) {
    const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / out});
    EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  }
  EXPECT_EQ(read_text(folder / "one/signals.csv"), read_text(folder / "two/signals.csv"));
  const auto report = read_report(folder / "one");
  ASSERT_EQ(report["losses"].size(), 1u) << "that of 2 s is longer than max_age, 1 s";
  EXPECT_EQ(report["losses"][0]["fault"], "silent");
  EXPECT_EQ(report["losses"][0]["permitted"], true);
  EXPECT_EQ(time_of(report, "fault paused ends"), 14'300'000'000);
}

TEST(Tank, PauseOfAKilledPlcChangesNothing) {
  const Folder folder;
  write_text(folder / "s.yaml",
             "scenario: tank whose PLC is killed\ninclude: [" + tank_file("tank.yaml") + R"(]
faults:
  - {name: killed, process: plc, state: killed, at: 6 s}
  - {name: paused, process: plc, state: paused, at: 7 s, for: 200 ms}
)");
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 1) << "the pump is not stopped: " << ended.output << ended.errors;
  EXPECT_EQ(read_report(folder / "out")["run_time_ns"], 16'000'000'000);
}

}  // namespace
}  // namespace hil::scenario_test
