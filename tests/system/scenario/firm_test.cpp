// Tasks with `transactions: firm` in real time: a scan that is late is discarded, counted and never used, and
// admission refuses scans whose predicted cost does not fit before the deadline.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// A scan of 10,000 wide beams takes a software device some 100 ms and is due after 20 ms. The car's commits
/// tell admission what a commit costs.
constexpr const char* scenario_text = R"(
scenario: firm
base_rate: 1 kHz
duration: 6 s
realtime: {scheduler: other, watchdog: 10 s, max_lost: 100 %}
world:
  layers: [body, ground, vehicle]
  entities:
    - {name: mast, shape: {box: [10 cm, 10 cm, 10 cm]}, mask: [body]}
    - {name: plain, shape: {box: [80 m, 80 m, 1 m]}, position: [0 m, 0 m, -2 m], mask: [ground]}
tasks:
  - module: traffic
    type: vehicles
    rate: 100 Hz
    parameters: {vehicles: {car: {position: [0 m, 900 m], speed: 1 m/s, desired_speed: 50 m/s}}}
  - module: lidar
    type: laser_scanner
    rate: 10 Hz
    deadline: 20 ms
    thread: scanner
    parameters:
      {carrier: mast, layers: [ground], object_layers: [ground], columns: 100, rows: 100,
       divergence: 2 deg, returns: 3, horizontal: 360 deg, vertical: 40 deg, scan_rate: 10 Hz}
)";

const nlohmann::json& task_of(const nlohmann::json& report) {
  const auto& tasks = report["tasks"];
  return *std::ranges::find_if(tasks, [](const auto& task) { return task["name"] == "lidar"; });
}

TEST(FirmTransactions, LateScansAreDiscardedCountedAndNeverUsed) {
  const ScenarioFolder scenario(scenario_text);
  const Ended soft = scenario.run("soft");
  ASSERT_LE(soft.code, 1) << soft.output << soft.errors;
  auto report = read_report(scenario.folder / "soft");
  EXPECT_GT(report["transactions"]["late"], 0);
  EXPECT_EQ(task_of(report)["discarded"], 0);
  EXPECT_GT(greatest(Signals(scenario.folder / "soft")["lidar.hits"]), 0.0) << "a soft scan is used late";

  const Ended firm = scenario.run("firm", {"--set", "tasks.lidar.transactions=firm"});
  ASSERT_LE(firm.code, 1) << firm.output << firm.errors;
  report = read_report(scenario.folder / "firm");
  const auto& task = task_of(report);
  const std::uint64_t runs = task["runs"];
  EXPECT_GT(runs, 20u);
  EXPECT_EQ(task["discarded"], runs);
  EXPECT_EQ(task["without_result"], runs);
  EXPECT_EQ(greatest(Signals(scenario.folder / "firm")["lidar.hits"]), 0.0);
  EXPECT_EQ(report["transactions"]["late"], 0);
  EXPECT_EQ(report["transactions"]["firm_late_commits"], 0);
  EXPECT_GT(report["transactions"]["missed"], 0) << "the first ones, whose cost is not known";
  EXPECT_GT(report["transactions"]["refused"], 10) << "admission knows the cost after these";
  EXPECT_GT(task["blocked_ns"]["max"], 5'000'000) << "scans that are stopped at the deadline";
  const std::string counted =
      std::to_string(runs) + " of them because a firm transaction was late or not admitted";
  EXPECT_NE(firm.output.find(counted), std::string::npos) << firm.output;
  EXPECT_NE(read_text(scenario.folder / "firm/report.html")
                .find(std::to_string(runs) + " because a firm transaction was late or not admitted"),
            std::string::npos);
}

TEST(FirmTransactions, ThatWriteAreRefused) {
  const ScenarioFolder scenario(
      std::string(scenario_text) +
      "  - {module: fly, type: free_body, rate: 1 kHz, transactions: firm,\n"
      "     parameters: {body: mast, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2]}}\n");
  const Ended ended = scenario.run("out");
  EXPECT_EQ(ended.code, 2);
  EXPECT_NE(
      ended.errors.find("'transactions: firm' is for tasks that only read the world; module fly of type "
                        "free_body writes to it, so leave the key out"),
      std::string::npos)
      << ended.errors;
}

}  // namespace
}  // namespace hil::scenario_test
