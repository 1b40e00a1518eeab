// Runs that lose a device, a process, ticks or a file do not pass.

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <thread>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/silent_listener.hpp"

namespace hil::scenario_test {
namespace {

constexpr const char* relaxed_timing_section =
    "realtime: {scheduler: other, lock_memory: false, watchdog: 30 s, max_lost: 100 %}\n";

/// A scenario with an empty world, in its folder.
class SmallScenario {
 public:
  explicit SmallScenario(const std::string& text) {
    write_text(folder_ / "map.yaml",
               "registers:\n"
               "  - {name: fault, table: holding, address: 0, type: u16, access: read}\n");
    write_text(folder_ / "small.yaml", "scenario: small\n" + text);
  }
  std::vector<std::string> run(const std::vector<std::string>& more = {}) const {
    return joined({{"run", folder_ / "small.yaml", "--out", out()}, more});
  }
  std::string file() const { return folder_ / "small.yaml"; }
  std::string out() const { return folder_ / "out"; }

 private:
  Folder folder_;
};

std::string unit_at(const std::string& address) {
  return "modbus:\n"
         "  - {unit: plc, device: \"" +
         address + "\", registers: map.yaml, rate: 20 Hz, timeout: 100 ms, max_age: 300 ms, read: [fault]}\n";
}

TEST(Losses, UnitThatNeverRepliesFailsTheRunAndItsExpectations) {
  const SilentListener unit;
  const SmallScenario scenario(std::string("duration: 2 s\n") + relaxed_timing_section +
                               unit_at(unit.address()) +
                               "expectations: [{name: no fault, never: modbus.plc.fault == 1}]\n");
  const Ended lost = run_hil(scenario.run());
  EXPECT_EQ(lost.code, 4) << lost.output << lost.errors;
  EXPECT_NE(lost.output.find("Modbus unit plc was lost from 0.000 s on for 2 s, to the end of the run"),
            std::string::npos)
      << lost.output;
  EXPECT_NE(lost.output.find("not checked: no fault"), std::string::npos) << lost.output;
  const auto report = read_report(scenario.out());
  ASSERT_EQ(report["losses"].size(), 1U);
  EXPECT_EQ(report["losses"][0]["what"], "Modbus unit plc");
  EXPECT_EQ(report["expectations"][0]["result"], "not_checked");
  EXPECT_EQ(report["expectations"][0]["passed"], false);
  const std::string junit = read_text(scenario.out() + "/junit.xml");
  EXPECT_NE(junit.find("Modbus unit plc was lost"), std::string::npos) << junit;
  EXPECT_NE(junit.find("type=\"not checked\""), std::string::npos) << junit;
  EXPECT_NE(read_text(scenario.out() + "/report.html").find("Modbus unit plc"), std::string::npos);

  const Ended permitted = run_hil(scenario.run({"--set", "modbus.plc.may_be_lost=true"}));
  EXPECT_EQ(permitted.code, 1) << "the expectation was still not checked\n" << permitted.output;
  const Ended expecting =
      run_hil(scenario.run({"--set", "modbus.plc.may_be_lost=true", "--set",
                            "expectations=[{name: away, eventually: modbus.plc.connected == 0}]"}));
  EXPECT_EQ(expecting.code, 0) << expecting.output;
}

TEST(Losses, UnitThatStopsReplyingUnderTheVirtualClockMayBeLost) {
  const SilentListener unit;
  const SmallScenario scenario(std::string("duration: 2 s\nclock: virtual\n") + unit_at(unit.address()) +
                               "expectations: [{name: away, eventually: modbus.plc.connected == 0}]\n");
  const Ended lost = run_hil(scenario.run());
  EXPECT_EQ(lost.code, 4) << lost.output << lost.errors;
  EXPECT_NE(lost.output.find("did not complete the exchange"), std::string::npos) << lost.output;
  EXPECT_LT(read_report(scenario.out())["ticks"], 200);

  const Ended permitted = run_hil(scenario.run({"--set", "modbus.plc.may_be_lost=true"}));
  EXPECT_EQ(permitted.code, 0) << permitted.output << permitted.errors;
  EXPECT_NE(permitted.output.find("lost, as the scenario permits: Modbus unit plc"), std::string::npos)
      << permitted.output;
  const auto report = read_report(scenario.out());
  EXPECT_EQ(report["losses"][0]["duration_ns"], 2'000'000'000);
  EXPECT_LE(report["modbus"][0]["requests"], 2) << "at the first tick, and to set safe values at the end";
}

TEST(Losses, UnitThatRestartsIsLostForATime) {
  const Folder folder;
  const std::string map = std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing_plc.yaml";
  const auto start_plc = [&](const std::string& port) {
    return std::make_unique<Program>(std::vector<std::string>{
        built("hil-crossing-plc"), "--listen", "127.0.0.1:" + port, "--clock", "wall", "--minimum-green-ms",
        "1500", "--yellow-ms", "1000", "--red-yellow-ms", "500"});
  };
  const std::string port = std::to_string(free_port());
  auto plc = start_plc(port);
  write_text(folder / "scenario.yaml",
             std::string("scenario: plc\nduration: 6 s\n") + relaxed_timing_section +
                 "modbus:\n  - {unit: plc, device: \"127.0.0.1:" + port + "\", registers: \"" + map +
                 "\", rate: 20 Hz, timeout: 200 ms, max_age: 300 ms, heartbeat: heartbeat_hil, run_time: "
                 "bench_time_ms, read: [fault]}\n");
  Program run(hil({"run", folder / "scenario.yaml", "--out", folder / "out"}));
  ASSERT_TRUE(run_begins(run, folder / "out"));
  const std::string log = folder / "out/run.log";
  // The test sleeps, since the lengths of the run with and without its PLC are the subject.
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  plc->signal(SIGKILL);
  EXPECT_TRUE(eventually([&] {
    return !run.running() || read_text(log).find("Modbus unit plc is lost") != std::string::npos;
  })) << read_text(log);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  plc = start_plc(port);
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  ASSERT_EQ(report["losses"].size(), 1U) << report["losses"];
  EXPECT_EQ(report["losses"][0]["to_the_end"], false);
  EXPECT_GT(report["losses"][0]["duration_ns"].get<std::int64_t>(), 300'000'000);
  const Signals signals(folder / "out");
  const auto& connected = signals["modbus.plc.connected"];
  EXPECT_TRUE(std::ranges::count(connected, 0.0) > 30 && connected.back() == 1.0);
  EXPECT_EQ(signals["modbus.plc.fault.fresh"].back(), 1.0);
}

TEST(Losses, ProcessThatEndsEarlyIsLostUnlessPermitted) {
  const SmallScenario scenario(
      std::string("duration: 2 s\n") + relaxed_timing_section +
      "processes:\n"
      "  tool: {command: [sh, \"-c\", \"sleep 0.5; echo gone away; exit 3\"], safe_on_exit: false}\n");
  const Ended lost = run_hil(scenario.run());
  EXPECT_EQ(lost.code, 4) << lost.output << lost.errors;
  EXPECT_NE(lost.output.find("process tool was lost from "), std::string::npos) << lost.output;
  EXPECT_NE(lost.output.find("exited with code 3"), std::string::npos) << lost.output;
  EXPECT_NE(lost.output.find("  last output of tool:\n    | gone away\n"), std::string::npos) << lost.output;
  EXPECT_EQ(read_report(scenario.out())["processes"][0]["last_lines"][0], "gone away");
  const std::string page = read_text(scenario.out() + "/report.html");
  EXPECT_NE(page.find("The last output of tool:"), std::string::npos);
  const Ended permitted = run_hil(scenario.run({"--set", "processes.tool.may_be_lost=true"}));
  EXPECT_EQ(permitted.code, 0) << permitted.output << permitted.errors;
  EXPECT_NE(permitted.output.find("lost, as the scenario permits: process tool"), std::string::npos)
      << permitted.output;
  const Ended default_exit = run_hil(scenario.run(
      {"--set", "processes.tool.may_be_lost=true", "--set", "processes.tool.safe_on_exit=true"}));
  EXPECT_EQ(default_exit.code, 0) << "what may be lost does not end the run\n" << default_exit.output;
}

TEST(Losses, RunThatSkipsMostOfItsTicksIsBroken) {
  const SmallScenario scenario(
      "duration: 3 s\n"
      "realtime: {scheduler: other, lock_memory: false, watchdog: 30 s}\n"
      "expectations: [{name: nothing collides, never: modbus.hmi.connected == 1}]\n"
      "modbus: [{unit: hmi, role: server, device: \"127.0.0.1:auto\", registers: map.yaml, rate: 10 Hz}]\n");
  Program run(hil(scenario.run()));
  ASSERT_TRUE(run_begins(run, scenario.out()));
  // The pause in real time is the subject. The first tick follows the line of the log, and a run that is
  // stopped before its first tick loses nothing.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  run.signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(3'000));  // as long as the run's duration
  run.signal(SIGCONT);
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 3) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("ticks skipped"), std::string::npos) << ended.output;
  EXPECT_NE(ended.output.find("the limit (realtime.max_lost) is 5 %"), std::string::npos) << ended.output;
  EXPECT_NE(ended.output.find("not checked: nothing collides"), std::string::npos) << ended.output;
}

TEST(Losses, RemovedRunFolderIsReported) {
  const SmallScenario scenario(std::string("duration: 3 s\n") + relaxed_timing_section +
                               "world: {entities: [{name: box, shape: {box: [1 m, 1 m, 1 m]}}]}\n"
                               "can: [{bus: car, database: \"" +
                               HIL_SOURCE_DIR + "/configs/crossing/crossing.dbc\", rate: 100 Hz}]\n");
  Program run(hil(scenario.run()));
  ASSERT_TRUE(run_begins(run, scenario.out()));
  std::filesystem::remove_all(scenario.out());
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  for (const char* file : {"signals.csv", "can-car.log", "database"})
    EXPECT_NE(ended.output.find(scenario.out() + "/" + file + " was removed while the run went on"),
              std::string::npos)
        << ended.output;
}

TEST(Losses, FilesThatCanNotBeWrittenAreReported) {
  const std::string many_rows =
      "clock: virtual\nbase_rate: 100 Hz\nduration: 200 s\ntasks:\n"
      "  - module: waves\n    type: block\n    rate: 100 Hz\n    parameters:\n"
      "      outputs: {a: sin(time / 1 s), b: sin(time / 2 s), c: sin(time / 3 s)}\n";
  const auto tool = [](const std::string& command) {
    return std::string("duration: 1 s\n") + relaxed_timing_section +
           "processes:\n  tool: {command: [sh, \"-c\", \"" + command + "; exec sleep 100\", out/tool.out]}\n";
  };
  for (const auto& [text, words] :
       {std::pair<std::string, std::string>(many_rows, "signals.csv"),
        {tool("head -c 1000000 /dev/zero"), "tool.out"},
        {tool("echo hello; sleep 0.5; : > $0; echo again"), "tool.out' was changed by another program"}}) {
    SCOPED_TRACE(words);
    const SmallScenario scenario(text);
    const Ended ended = run_with_file_limit(500, scenario.run());
    EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
    EXPECT_NE(ended.output.find(words), std::string::npos) << ended.output;
    EXPECT_EQ(read_report(scenario.out())["verdict"], "io_failed");
  }
}

TEST(Losses, ProcessThatEndsAtItsStartIsTheReason) {
  const SmallScenario scenario(
      std::string("duration: 1 s\n") + relaxed_timing_section +
      "modbus: [{unit: plc, device: \"127.0.0.1:auto\", registers: map.yaml, rate: 20 Hz, read: [fault]}]\n"
      "processes:\n  plc: {command: [sh, \"-c\", \"sleep 0.2; echo no such bus; exit 7\", "
      "\"{modbus.plc}\"]}\n");
  const Ended ended = run_hil(scenario.run());
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  const auto reason = read_report(scenario.out())["reason"].get<std::string>();
  EXPECT_EQ(reason.find("process plc exited with code 7 before the run began"), 0U) << reason;
  EXPECT_NE(reason.find(". Its last lines:\n  | no such bus"), std::string::npos) << reason;
}

}  // namespace
}  // namespace hil::scenario_test
