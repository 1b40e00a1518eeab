// configs/ecu: an ECU in Python, and faults of the frames that it reads, of its process and of its bus.

#include <gtest/gtest.h>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

std::string ecu_file(const std::string& name) {
  return std::string(HIL_SOURCE_DIR) + "/configs/ecu/" + name;
}

std::vector<std::string> fault_events(const nlohmann::json& report) {
  std::vector<std::string> events;
  for (const auto& event : report["events"]) {
    if (const std::string text = event["text"]; text.starts_with("fault "))
      events.push_back(std::to_string(event["time_ns"].get<std::int64_t>() / 1'000'000) + " " + text);
  }
  return events;
}

TEST(Ecu, NoticesEachFault) {
  const Folder folder;
  const Ended ended = run_hil({"run", ecu_file("ecu.yaml"), "--out", folder / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  const std::vector<std::string> events = fault_events(report);
  ASSERT_EQ(events.size(), 10u);
  EXPECT_EQ(events[0],
            "4000 fault frozen_counter begins: can.car.VehicleSpeed with a counter that stands still");
  EXPECT_EQ(events[1], "4500 fault frozen_counter ends");
  EXPECT_EQ(events[8], "12000 fault paused_ecu begins: ecu paused");
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(report["faults"][i]["frames"], 50) << "500 ms of one frame in 10 ms";
  EXPECT_TRUE(report["losses"].empty());
}

TEST(Ecu, RunsAreByteForByteAlike) {
  const Folder folder;
  for (const char* const out : {"one", "two"})
    ASSERT_EQ(run_hil({"run", ecu_file("ecu.yaml"), "--out", folder / out}).code, 0);
  EXPECT_EQ(read_text(folder / "one/signals.csv"), read_text(folder / "two/signals.csv"));
}

TEST(Ecu, ThatReactsLateFails) {
  const Folder folder;
  const Ended ended = run_hil({"run", ecu_file("late.yaml"), "--out", folder / "out"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("it limits within 20 ms"), std::string::npos) << ended.output;
}

/// The task of this name in the report.
nlohmann::json task_of(const nlohmann::json& report, const std::string& name) {
  for (const auto& task : report["tasks"])
    if (task["name"] == name) return task;
  ADD_FAILURE() << "no task " << name;
  return nullptr;
}

TEST(Ecu, RunsInRealTime) {
  const Folder folder;
  // On a machine that others use, too, the ECU's process may wait for longer than its time of reaction.
  const Ended ended =
      run_hil(joined({{"run", ecu_file("ecu.yaml"), "--clock", "realtime", "--out", folder / "out", "--set",
                       "expectations.it limits within 20 ms.reaction.within=200 ms"},
                      relaxed_timing()}));
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  const std::int64_t tolerance_ns = 1'000'000 * (1 + report["skipped_ticks"].get<std::int64_t>());
  for (std::size_t i = 0; i < 5; ++i) {
    const std::int64_t at_ns = 2'000'000'000 * static_cast<std::int64_t>(i + 2);
    EXPECT_GE(report["faults"][i]["first_begin_ns"], at_ns);
    EXPECT_LT(report["faults"][i]["first_begin_ns"], at_ns + tolerance_ns) << "within one tick";
  }
}

/// A bus with the ECU, whose faults and expectations `sections` has; VehicleSpeed is 80 km/h.
Ended run_with(const Folder& folder, const std::string& sections) {
  write_text(folder / "s.yaml", R"(
scenario: ecu with other faults
base_rate: 1 kHz
duration: 2 s
clock: virtual
can:
  - bus: car
    device: virtual
    database: )" + ecu_file("ecu.dbc") +
                                    R"(
    rate: 1 kHz
    send:
      - {message: VehicleSpeed, counter: Counter, checksum: Checksum, signals: {Speed: 80, Standstill: 0}}
      - {message: Driver}
    receive:
      - {message: Limiter, timeout: 50 ms}
processes:
  ecu:
    command: [)" + ecu_file("ecu.py") +
                                    R"(, --bus, "{can.car}", --clock, "{clock}"]
)" + sections);
  return run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
}

TEST(EcuFaults, KilledProcessEndsNothingButItself) {
  const Folder folder;
  const Ended ended = run_with(folder, R"(
faults:
  - {name: crash, process: ecu, state: killed, at: 1 s}
expectations:
  - {name: stale, eventually: can.car.Limiter.fresh == 0 and fault.crash == 1, by: 1.052 s}
  - {name: alive, never: can.car.Limiter.fresh == 0 and time > 0.1 s and fault.crash == 0}
)");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  ASSERT_EQ(report["losses"].size(), 1u);
  EXPECT_EQ(report["losses"][0]["what"], "process ecu");
  EXPECT_EQ(report["losses"][0]["fault"], "crash");
  EXPECT_EQ(report["losses"][0]["permitted"], true);
  EXPECT_EQ(report["run_time_ns"], 2'000'000'000);
}

TEST(EcuFaults, BusOffIsNoFaultOfTheRun) {
  const Folder folder;
  const Ended ended = run_with(folder, R"(
faults:
  - {name: off, device: can.car, state: bus_off, at: 1 s, for: 500 ms}
expectations:
  - {name: disconnected, reaction: {when: fault.off == 1, then: can.car.connected == 0, within: 2 ms}}
  - {name: connected, reaction: {when: fault.off == 0, then: can.car.connected == 1, within: 2 ms, at_least: 2}}
)");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  ASSERT_EQ(report["losses"].size(), 1u);
  EXPECT_EQ(report["losses"][0]["what"], "CAN bus car");
  EXPECT_EQ(report["losses"][0]["fault"], "off");
  EXPECT_EQ(report["losses"][0]["begin_ns"], 1'001'000'000);
}

TEST(EcuFaults, OfReceivedMessages) {
  const Folder folder;
  const Ended ended = run_with(folder, R"(
faults:
  - {name: late, message: can.car.Limiter, delay: 100 ms, at: 500 ms, for: 200 ms}
  - {name: flipped, message: can.car.Limiter, flip_bits: [0], at: 1 s, for: 100 ms}
  - {name: twice, message: can.car.Limiter, repeat: 1, at: 1.5 s, for: 100 ms}
expectations:
  - {name: gap, eventually: can.car.Limiter.fresh == 0 and fault.late == 1, by: 552 ms}
  - {name: inverted, reaction: {when: fault.flipped == 1, then: can.car.Limiter.Active == 0, within: 11 ms}}
)");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["faults"][0]["frames"], 20);
  EXPECT_EQ(report["faults"][1]["frames"], 10);
  EXPECT_EQ(report["faults"][2]["frames"], 10);
}

TEST(EcuFaults, FaultWithoutAFrameIsNotChecked) {
  const Folder folder;
  const Ended ended = run_with(folder, R"(
faults:
  - {name: between, message: can.car.Driver, drop: 100 %, at: 101 ms, for: 50 ms}
)");
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_NE(
      ended.output.find("fault 'between' was active from 101 ms to 151 ms, but no frame or request came"),
      std::string::npos)
      << ended.output;
}

TEST(EcuFaults, TaskTakesLongerAndMissesItsDeadline) {
  const Folder folder;
  const Ended ended = run_with(folder, R"(
tasks:
  - {module: plant, type: block, rate: 100 Hz, thread: slow, parameters: {outputs: {y: time}}}
faults:
  - {name: slow, task: plant, takes_longer: 12 ms, at: 1 s, for: 100 ms}
)");
  const auto report = read_report(folder / "out");
  const auto task = task_of(report, "plant");
  EXPECT_EQ(task["deadline_misses"], 5) << "each run of 12 ms covers two releases";
  EXPECT_EQ(task["misses_by_cause"][0]["cause"], "own work");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
}

TEST(EcuFaults, TaskOfTheBaseThreadDelaysTheTicks) {
  const Folder folder;
  const Ended ended = run_with(folder, R"(
tasks:
  - {module: plant, type: block, rate: 100 Hz, parameters: {outputs: {y: time}}}
faults:
  - {name: slow, task: plant, takes_longer: 4 ms, at: 1 s, for: 100 ms}
)");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  const auto task = task_of(report, "plant");
  EXPECT_EQ(task["wall_ns"]["max"], 4'000'000);
  EXPECT_EQ(task["deadline_misses"], 0) << "its deadline is its period";
  EXPECT_EQ(task_of(report, "can.car")["deadline_misses"], 30) << "in three ticks of each of ten steps";
}

}  // namespace
}  // namespace hil::scenario_test
