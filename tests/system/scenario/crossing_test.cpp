// The crossing under the virtual clock, at its full resolution.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// The rows of the table of touches; empty: the report has no such section.
nlohmann::json touches_in(const nlohmann::json& report) {
  for (const auto& section : report["sections"]) {
    if (section["title"] == "Where bodies touched traffic.ego") return section["tables"].at(0)["rows"];
  }
  return nlohmann::json::array();
}

/// Removes the values that differ between two runs: measured times, and the addresses that the run chose.
void leave_out_measurements(nlohmann::json& node) {
  static const std::vector<std::string> measured{
      "started_at", "wall_ns", "cpu_ns", "gpu_ns", "blocked_ns", "wake_latency_ns", "slack_ns", "page_faults",
      "per_tick_ns", "total_ns", "driver", "command", "checksum",
      // of the log: how commits came together into writes
      "all_writes_ns", "longest_write_ns", "groups", "bytes", "segments", "ring_high_water_bytes"};
  if (node.is_object()) {
    for (const std::string& key : measured)
      node.erase(key);
  }
  if (node.is_structured()) {
    for (auto& child : node)
      leave_out_measurements(child);
  }
}

TEST(VirtualCrossing, ReachesThePlcOverIpv6) {
  const Folder folder;
  const Ended run = run_hil(joined({{"run", crossing(), "--clock", "virtual", "--duration", "1 s", "--out",
                                     folder / "out", "--set", "modbus.plc.device=\"[::1]:auto\""},
                                    few_beams()}));
  EXPECT_EQ(run.code, 1) << "too few answers in this time: " << run.output << run.errors;
  EXPECT_TRUE(read_text(folder / "out/plc.out").starts_with("listening [::1]:"));
}

TEST(VirtualCrossing, StopsTheCarWithTheController) {
  const Folder folder;
  const Ended run = run_hil({"run", crossing(), "--clock", "virtual", "--out", folder / "out"});
  EXPECT_EQ(run.code, 0) << run.output << run.errors;
  RecordProperty("wall_s_for_10_s", std::to_string(run.took.count()));

  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "passed");
  EXPECT_EQ(report["ticks"], 10000);
  ASSERT_GE(report["expectations"].size(), 2U);
  for (const auto& expectation : report["expectations"])
    EXPECT_TRUE(expectation["passed"].get<bool>()) << expectation;
  const auto has_event = [&](const std::string& words) {
    return std::ranges::any_of(report["events"], [&](const auto& event) {
      return event["text"].template get<std::string>().find(words) != std::string::npos;
    });
  };
  EXPECT_TRUE(has_event("the device under test requests")) << report["events"];
  EXPECT_TRUE(has_event("the ego stops")) << report["events"];
  EXPECT_FALSE(has_event("is touched at")) << report["events"];
  EXPECT_TRUE(touches_in(report).empty());
  for (const auto& process : report["processes"])
    EXPECT_EQ(process["exit"], "exited with code 0") << process;

  const Signals signals(folder / "out");
  EXPECT_EQ(signals.rows(), 1000U);
  EXPECT_GT(greatest(signals["can.car.BrakeCommand.Deceleration"]), 1.0);
  EXPECT_EQ(greatest(signals["collision.total"]), 0.0);
  // The impact comes nearer until the ego brakes. While it stands still none is ahead.
  const std::vector<double>& impact_s = signals["impact.time_to_impact"];
  EXPECT_LT(*std::ranges::min_element(impact_s), 2.5);
  EXPECT_GT(*std::ranges::min_element(impact_s), 1.0);
  EXPECT_EQ(greatest(impact_s), 4.0);
  ASSERT_FALSE(signals["traffic.ego.speed"].empty());
  EXPECT_GT(signals["traffic.ego.speed"].front(), 5.0);
  EXPECT_EQ(*std::ranges::min_element(signals["traffic.ego.speed"]), 0.0) << "the ego stops";
  const auto frames = read_can_log(folder / "out/can-car.log");
  EXPECT_GT(greatest(values_on_bus(frames, "BrakeCommand.Deceleration")), 1.0);
  EXPECT_EQ(values_on_bus(frames, "ObjectHeader.Counter").size(), 1001U)
      << "100 Hz, and the safe values at the end";
}

TEST(VirtualCrossing, CollidesWithoutTheController) {
  const Folder folder;
  const Ended run = run_hil(
      {"run", crossing(), "--clock", "virtual", "--set", "dut.enabled=false", "--out", folder / "out"});
  EXPECT_EQ(run.code, 1) << run.output << run.errors;
  EXPECT_NE(run.output.find("no collision"), std::string::npos) << run.output;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "failed");
  EXPECT_EQ(report["exit_code"], 1);
  EXPECT_EQ(report["expectations"][0]["name"], "no collision");
  EXPECT_FALSE(report["expectations"][0]["passed"].get<bool>());
  EXPECT_GT(report["expectations"][0]["first_failure_ns"].get<std::int64_t>(), 0);
  const Signals signals(folder / "out");
  EXPECT_GT(greatest(signals["collision.total"]), 0.0);
  EXPECT_EQ(greatest(signals["can.car.BrakeCommand.Deceleration"]), 0.0);

  // Without a brake the time to the impact runs down to the collision.
  EXPECT_FALSE(report["expectations"][1]["passed"].get<bool>());
  EXPECT_LT(*std::ranges::min_element(signals["impact.time_to_impact"]), 0.1);
  // Where: within both cars, at the crossing, and at a closing speed of cars.
  const nlohmann::json touches = touches_in(report);
  ASSERT_GE(touches.size(), 1U) << report["sections"];
  EXPECT_EQ(touches[0].at(0)["text"], "traffic.runner");
  const auto number = [&](std::size_t column) { return touches[0].at(column)["number"].get<double>(); };
  EXPECT_NEAR(number(1), report["expectations"][0]["first_failure_ns"].get<double>() * 1e-9, 0.011);
  EXPECT_LT(std::hypot(number(2), number(3)), 10.0) << "of the middle of the crossing";
  for (const std::size_t car : {5U, 8U}) {
    EXPECT_LT(std::abs(number(car)), 2.3) << "within its length";
    EXPECT_LT(std::abs(number(car + 1)), 1.0) << "within its width";
  }
  EXPECT_GT(number(11), 5.0);
  EXPECT_LT(number(11), 20.0);
  EXPECT_GE(number(12), 0.0);
  EXPECT_TRUE(std::ranges::any_of(report["events"], [](const auto& event) {
    return event["text"].template get<std::string>().starts_with("traffic.ego is touched at");
  })) << report["events"];
  EXPECT_NE(read_text(folder / "out/report.html").find("Where bodies touched traffic.ego"),
            std::string::npos);

  const std::string junit = read_text(folder / "out/junit.xml");
  const std::size_t failed = junit.find("name=\"no collision\"");
  ASSERT_NE(failed, std::string::npos) << junit;
  const std::size_t end = junit.find("</testcase>", failed);
  EXPECT_LT(junit.find("<failure ", failed), end) << junit;
  EXPECT_EQ(junit.find("failures=\"0\""), std::string::npos) << junit;
}

TEST(VirtualCrossing, RepeatsForOneSeed) {
  const Folder folder;
  std::vector<nlohmann::json> reports;
  for (const char* name : {"first", "second"}) {
    const Ended run =
        run_hil({"run", crossing(), "--clock", "virtual", "--seed", "7", "--out", folder / name});
    ASSERT_EQ(run.code, 0) << run.output << run.errors;
    reports.push_back(read_report(folder / name));
    EXPECT_EQ(reports.back()["seed"], 7);
    leave_out_measurements(reports.back());
  }
  const auto same = [&](const std::string& file) {
    return read_text(folder / ("first/" + file)) == read_text(folder / ("second/" + file));
  };
  EXPECT_TRUE(same("signals.csv"));
  EXPECT_TRUE(same("can-car.log"));
  const auto history = [&](const char* run) { return run_hil({"db", "export", folder / run}).output; };
  EXPECT_GT(history("first").size(), 1'000'000U);
  EXPECT_TRUE(history("first") == history("second"));
  EXPECT_EQ(nlohmann::json::diff(reports[0], reports[1]), nlohmann::json::array());
  EXPECT_GT(reports[0].dump().size(), 50000U) << "nearly the whole report is compared";

  // The digest covers every answer to the scanner's queries, so it changes.
  const Signals signals(folder / "first");
  const std::vector<double>& digest = signals["scanner.digest"];
  ASSERT_EQ(digest.size(), 1000U);
  EXPECT_NE(digest[100], digest[500]);
  EXPECT_NE(digest[500], digest[999]);
}

}  // namespace
}  // namespace hil::scenario_test
