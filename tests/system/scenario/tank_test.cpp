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

}  // namespace
}  // namespace hil::scenario_test
