// configs/crossing with a fault that a distance triggers: the object list freezes while the runner is near.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

constexpr double freezes_at_m = 20.0;
constexpr std::int64_t ns_per_ms = 1'000'000;
const std::string checked = "frozen_list.yaml", unchecked = "no_plausibility_check.yaml";

std::string crossing_file(const std::string& name) {
  return std::string(HIL_SOURCE_DIR) + "/configs/crossing/" + name;
}

/// "MILLISECONDS TEXT" of the events that begin with `begin`.
std::vector<std::string> events_of(const nlohmann::json& report, const std::string& begin) {
  std::vector<std::string> events;
  for (const auto& event : report["events"]) {
    if (const std::string text = event["text"]; text.starts_with(begin))
      events.push_back(std::to_string(event["time_ns"].get<std::int64_t>() / ns_per_ms) + " " + text);
  }
  return events;
}

nlohmann::json expectation_of(const nlohmann::json& report, const std::string& name) {
  for (const auto& expectation : report["expectations"])
    if (expectation["name"] == name) return expectation;
  ADD_FAILURE() << "no expectation '" << name << "'";
  return nullptr;
}

/// Between the bodies of ego and runner, 4.5 m x 1.8 m each, of which one drives along x and one along y.
std::vector<double> distances(const Signals& signals) {
  constexpr double reach_m = 0.5 * (4.5 + 1.8);
  std::vector<double> all;
  for (std::size_t row = 0; row < signals.rows(); ++row) {
    const auto gap = [&](const std::string& axis) {
      const double apart_m =
          std::abs(signals["traffic.runner." + axis][row] - signals["traffic.ego." + axis][row]);
      return std::max(apart_m - reach_m, 0.0);
    };
    all.push_back(std::hypot(gap("x"), gap("y")));
  }
  return all;
}

/// When the distance first falls below `limit_m`, in ms, from its values every 10 ms.
double falls_below_ms(const std::vector<double>& distances_m, double limit_m) {
  const auto below = std::ranges::find_if(distances_m, [&](double d) { return d < limit_m; });
  if (below == distances_m.begin() || below == distances_m.end()) {
    ADD_FAILURE() << "the distance does not fall below " << limit_m;
    return 0.0;
  }
  const auto row = static_cast<double>(below - distances_m.begin());
  return 10.0 * (row - (limit_m - *below) / (*(below - 1) - *below));
}

/// Values of a signal on the bus in [begin, end) ms.
std::vector<double> values_between(const std::vector<io::can::LoggedFrame>& frames, const std::string& name,
                                   std::int64_t begin_ms, std::int64_t end_ms) {
  std::vector<io::can::LoggedFrame> some;
  std::ranges::copy_if(frames, std::back_inserter(some), [&](const io::can::LoggedFrame& logged) {
    return logged.frame.time_ns >= begin_ms * ns_per_ms && logged.frame.time_ns < end_ms * ns_per_ms;
  });
  return values_on_bus(some, name);
}

/// One run with the check, which its tests read.
class FrozenList : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<Folder>();
    ended_ = run_hil({"run", crossing_file(checked), "--out", out()});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  void SetUp() override { ASSERT_EQ(ended_.code, 0) << ended_.output << ended_.errors; }
  static std::string out() { return *folder_ / "out"; }

 private:
  inline static std::unique_ptr<Folder> folder_;
  inline static Ended ended_;
};

TEST_F(FrozenList, StopsTheCarWithTheCheck) {
  const auto report = read_report(out());
  EXPECT_EQ(events_of(report, "fault frozen_"),
            (std::vector<std::string>{
                "4986 fault frozen_object0 begins: can.car.Object0 stuck at its last payload",
                "4986 fault frozen_object1 begins: can.car.Object1 stuck at its last payload",
                "4986 fault frozen_object2 begins: can.car.Object2 stuck at its last payload",
                "4986 fault frozen_object3 begins: can.car.Object3 stuck at its last payload",
                "4986 fault frozen_header begins: can.car.ObjectHeader stuck at its last payload",
                "8584 fault frozen_object0 ends", "8584 fault frozen_object1 ends",
                "8584 fault frozen_object2 ends", "8584 fault frozen_object3 ends",
                "8584 fault frozen_header ends"}));
  // The last live list is that of 4980 ms; the command takes effect in the tick after the list of 5180 ms.
  EXPECT_EQ(events_of(report, "the device under test requests"),
            (std::vector<std::string>{"5181 the device under test requests 5.0 m/s2"}));
  EXPECT_EQ(events_of(report, "the ego stops").size(), 1U);
  EXPECT_TRUE(events_of(report, "traffic.ego is touched").empty());
  for (const auto& fault : report["faults"])
    EXPECT_EQ(fault["frames"], 360) << "of the lists from 4990 ms to 8580 ms";

  // The distance of a tick is visible a tick later, and begins the fault in the tick after that.
  const Signals signals(out());
  EXPECT_EQ(std::ceil(falls_below_ms(distances(signals), freezes_at_m)) + 2.0, 4986.0);
}

TEST_F(FrozenList, RepeatsItsObjectsWithValidCountersAndChecksums) {
  const auto frames = read_can_log(out() + "/can-car.log");
  for (const std::string object : {"Object0", "Object1", "Object2", "Object3"}) {
    for (const char* const signal : {".Valid", ".PosX", ".PosY", ".Age"}) {
      const std::vector<double> frozen = values_between(frames, object + signal, 4980, 8584);
      ASSERT_EQ(frozen.size(), 361U) << "the last live one, and the frozen ones";
      EXPECT_EQ(std::ranges::count(frozen, frozen.front()), 361) << object << signal;
    }
  }
  EXPECT_EQ(greatest(values_between(frames, "Object2.Valid", 4980, 8584)), 1.0) << "the runner";
  const std::vector<double> counters = values_between(frames, "ObjectHeader.Counter", 4980, 8584);
  for (std::size_t i = 1; i < counters.size(); ++i)
    ASSERT_EQ(counters[i], counters[i - 1] + 1.0);
  EXPECT_EQ(values_between(frames, "BrakeCommand.AnswerTo", 4980, 8584), counters) << "it answers each list";
}

TEST_F(FrozenList, RunsAreByteForByteAlike) {
  const Folder folder;
  ASSERT_EQ(run_hil({"run", crossing_file(checked), "--out", folder / "again"}).code, 0);
  for (const std::string file : {"signals.csv", "can-car.log"})
    EXPECT_TRUE(read_text(out() + "/" + file) == read_text(folder / ("again/" + file))) << file;
  const auto history = [&](const std::string& run) { return run_hil({"db", "export", run}).output; };
  EXPECT_GT(history(out()).size(), 1'000'000U);
  EXPECT_TRUE(history(out()) == history(folder / "again"));
}

TEST_F(FrozenList, CollidesWithoutTheCheck) {
  const Folder folder;
  const Ended ended = run_hil({"run", crossing_file(unchecked), "--out", folder / "out"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  const auto fault = events_of(report, "fault frozen_header");
  ASSERT_FALSE(fault.empty());
  EXPECT_TRUE(fault[0].starts_with("4986 ")) << fault[0];
  const auto no_collision = expectation_of(report, "no collision");
  EXPECT_EQ(no_collision["passed"], false);
  EXPECT_EQ(no_collision["first_failure_ns"], 6825 * ns_per_ms);
  EXPECT_EQ(expectation_of(report, "the controller brakes within 250 ms of the fault")["passed"], false);
  EXPECT_EQ(expectation_of(report, "the list freezes when the runner is within 20 m")["passed"], true);
  EXPECT_EQ(expectation_of(report, "the DUT answers within 50 ms")["passed"], true);
  EXPECT_TRUE(events_of(report, "the device under test requests").empty());
  const Signals signals(folder / "out");
  EXPECT_EQ(greatest(signals["can.car.BrakeCommand.Deceleration"]), 0.0);
  EXPECT_EQ(greatest(signals["can.car.BrakeCommand.Degraded"]), 0.0) << "it has what it needs to brake";
}

/// The same traffic, scanner and controller, but every list is live.
TEST_F(FrozenList, WithoutTheFaultNoCheckIsNeeded) {
  const Folder folder;
  const std::string command =
      "dut.command=[hil-aeb-controller, --bus, \"{can.car}\", --database, crossing.dbc, "
      "--no-plausibility-check]";
  const Ended ended =
      run_hil({"run", crossing(), "--clock", "virtual", "--out", folder / "out", "--set",
               "tasks.traffic.parameters.vehicles.ego.desired_speed=26 km/h", "--set",
               "tasks.scanner.parameters.columns=240", "--set", "tasks.scanner.parameters.rows=48", "--set",
               "tasks.scanner.parameters.compare=[]", "--set", command});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  EXPECT_EQ(events_of(read_report(folder / "out"), "the device under test requests").size(), 1U);
}

}  // namespace
}  // namespace hil::scenario_test
