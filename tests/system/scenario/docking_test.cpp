// The docking under the virtual clock: with beams the guidance docks, with rays it does not find the port.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

std::string docking(const std::string& file) {
  return std::string(HIL_SOURCE_DIR) + "/configs/docking/" + file;
}

/// The result of an expectation: "held", "failed" or "not_checked".
std::string result_of(const nlohmann::json& report, const std::string& name) {
  for (const auto& expectation : report["expectations"]) {
    if (expectation["name"] == name) return expectation["result"];
  }
  return "there is no expectation '" + name + "'";
}

TEST(VirtualDocking, CapsuleDocksWithBeamsThatTileItsView) {
  const Folder folder;
  const Ended run = run_hil({"run", docking("docking.yaml"), "--clock", "virtual", "--out", folder / "out"});
  EXPECT_EQ(run.code, 0) << run.output << run.errors;
  RecordProperty("wall_s_for_120_s", std::to_string(run.took.count()));
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "passed");
  for (const auto& expectation : report["expectations"])
    EXPECT_TRUE(expectation["passed"].get<bool>()) << expectation;
  for (const auto& process : report["processes"])
    EXPECT_EQ(process["exit"], "exited with code 0") << process;

  const Signals signals(folder / "out");
  EXPECT_EQ(signals["port.docked"].back(), 1.0);
  EXPECT_LT(signals["port.capture_lateral"].back(), 0.1);
  EXPECT_GT(signals["port.capture_speed"].back(), 0.02);
  EXPECT_GT(signals["port.distance"].at(10), 39.0) << "it began far away";
  EXPECT_GT(greatest(signals["can.capsule.ThrustCommand.ForceX"]), 100.0);
  EXPECT_GE(greatest(signals["scanner.target_count"]), 8.0);
  // Far fewer rows than the 12,000 steps.
  EXPECT_GT(signals["capsule_motion.rows"].back(), 50.0);
  EXPECT_LT(signals["capsule_motion.rows"].back(), 2'000.0);
  // The capture is the contact: the body touches the ring, at the speed that the report has.
  EXPECT_EQ(signals["port.touches"].back(), 1.0);
  EXPECT_EQ(signals["capsule_motion.touched"].back(), 1.0);
  EXPECT_EQ(signals["port.touch_speed"].back(), signals["port.capture_speed"].back());
  const std::size_t docked_at = static_cast<std::size_t>(std::ranges::find(signals["port.docked"], 1.0) -
                                                         signals["port.docked"].begin());
  EXPECT_GT(signals["capsule_motion.depth"].at(docked_at), 0.0);
  EXPECT_EQ(greatest(signals["capsule_motion.late"]), 0.0);
  const auto& contacts = report["sections"].at(0);
  ASSERT_EQ(contacts["title"], "Contacts of capsule_motion");
  ASSERT_EQ(contacts["tables"].at(0)["rows"].size(), 1U);
  const auto& touch = contacts["tables"].at(0)["rows"].at(0);
  EXPECT_EQ(touch.at(0)["text"], "capsule, port_ring");
  EXPECT_NEAR(std::hypot(touch.at(2)["number"].get<double>(), touch.at(4)["number"].get<double>()), 0.6, 0.1)
      << "on the ring";
  EXPECT_NEAR(touch.at(5)["number"].get<double>(), signals["port.touch_speed"].back(), 5e-3);
}

/// The port captures below 5 mm/s only. The guidance comes with 7 cm/s, from nearby: the capsule touches the
/// ring, bounces and is never docked.
TEST(VirtualDocking, ATouchThatIsTooFastIsNoDocking) {
  const Folder folder;
  const Ended run = run_hil({"run", docking("docking.yaml"), "--clock", "virtual", "--out", folder / "out",
                             "--duration", "50 s", "--set", "expectations.docked in time.by=49 s", "--set",
                             "tasks.scanner.parameters.rows=24", "--set",
                             "world.entities.capsule.position=[0.5 m, 9 m, -0.3 m]", "--set",
                             "tasks.port.parameters.capture.closing_speed=0.005 m/s"});
  EXPECT_EQ(run.code, 1) << run.output << run.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(result_of(report, "docked in time"), "failed");
  const Signals signals(folder / "out");
  EXPECT_EQ(greatest(signals["port.docked"]), 0.0);
  EXPECT_GE(signals["port.touches"].back(), 1.0);
  EXPECT_GT(greatest(signals["port.touch_speed"]), 0.02);
  EXPECT_GT(greatest(signals["capsule_motion.contacts"]), 0.0);
  EXPECT_GT(-*std::ranges::min_element(signals["port.closing_speed"]), 1e-3) << "it bounces";
  const auto has_event = [&](const std::string& words) {
    return std::ranges::any_of(report["events"], [&](const auto& event) {
      return event["text"].template get<std::string>().find(words) != std::string::npos;
    });
  };
  EXPECT_TRUE(has_event("and is not captured: it is not within the limits")) << report["events"];
  EXPECT_FALSE(has_event("is captured at"));
}

TEST(VirtualDocking, WithRaysThePortIsNotFoundInTime) {
  const Folder folder;
  const Ended run = run_hil({"run", docking("docking.yaml"), "--clock", "virtual", "--out", folder / "out",
                             "--duration", "60 s", "--set", "expectations.docked in time.by=59 s", "--set",
                             "tasks.scanner.parameters.divergence=0 deg"});
  EXPECT_EQ(run.code, 1) << run.output << run.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(result_of(report, "docked in time"), "failed");
  EXPECT_EQ(result_of(report, "the DUT answers within 100 ms"), "held") << "the guidance itself works";
  const Signals signals(folder / "out");
  EXPECT_EQ(greatest(signals["can.capsule.GuidanceStatus.Mode"]), 0.0) << "it searches to the end";
}

/// The study with fewer pixels, rays and distances.
TEST(VirtualDocking, StudyShowsWhatRaysMiss) {
  const Folder folder;
  const Ended run = run_hil(
      {"run", docking("study.yaml"), "--out", folder / "out", "--duration", "2 s", "--set",
       "tasks.study.parameters.pixels=270", "--set", "tasks.study.parameters.beams=[0.21 deg]", "--set",
       "tasks.study.parameters.samples=[1, 64]", "--set", "tasks.study.parameters.distances=[20 m, 200 m]"});
  EXPECT_EQ(run.code, 0) << run.output << run.errors;
  const auto report = read_report(folder / "out");
  const auto& section = report["sections"].at(0);
  EXPECT_EQ(section["plots"].size(), 2U);
  EXPECT_EQ(section["tables"].at(0)["rows"].size(), 6U);
  for (const char* image : {"study-0020m-1rays.png", "study-0200m-64rays.png", "study-0200m-beam0p21deg.png"})
    EXPECT_GT(std::filesystem::file_size(std::filesystem::path(folder / "out/images") / image), 100U)
        << image;
}

}  // namespace
}  // namespace hil::scenario_test
