// The files that a run writes.

#include "tests/system/scenario/run_files.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <set>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"

namespace hil::scenario_test {
namespace {

/// The files of one run of the crossing, which all tests of the suite read.
class RunFiles : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    run_folder = std::make_unique<Folder>();
    const Ended run = run_hil(
        joined({{"run", crossing(), "--clock", "virtual", "--out", *run_folder / "out"}, few_beams()}));
    ASSERT_EQ(run.code, 0) << run.output << run.errors;
  }
  static void TearDownTestSuite() { run_folder.reset(); }
  static std::string out(const std::string& file = {}) { return *run_folder / ("out/" + file); }

 private:
  static inline std::unique_ptr<Folder> run_folder;
};

TEST_F(RunFiles, ReportIsRemadeByteForByte) {
  std::map<std::string, std::string> files;
  for (const std::string file : {"report.html", "junit.xml", "report.json"})
    files[file] = read_text(out(file));
  std::filesystem::remove(out("report.html"));
  std::filesystem::remove(out("junit.xml"));
  const Ended again = run_hil({"report", out()});
  EXPECT_EQ(again.code, 0) << again.errors;
  EXPECT_NE(again.output.find("Passed"), std::string::npos) << again.output;
  for (const auto& [file, text] : files)
    EXPECT_TRUE(read_text(out(file)) == text) << file << " differs";
}

TEST(RunFolder, LogDescribesTheRunAndIsPrintedWithVerbose) {
  const Folder folder;
  const Ended run = run_hil(
      joined({{"run", crossing(), "--clock", "virtual", "--out", folder / "out", "--verbose"}, few_beams()}));
  EXPECT_EQ(run.code, 0) << run.output << run.errors;
  const std::string log = read_text(folder / "out/run.log");
  EXPECT_EQ(log, run.errors);
  std::size_t at = 0;
  for (const char* text : {"scenario crossing from ", "GPU: ", "bus car: unix:", "started dut (process ",
                           "started plc (process ", "Modbus unit plc: 127.0.0.1:", "the run begins",
                           "the run is over after 10000 ticks", "exit code 0: every expectation held"}) {
    at = log.find(text, at);
    ASSERT_NE(at, std::string::npos) << text << " is not in its place in\n" << log;
  }
}

TEST(RunFolder, ReasonOfAFailedStartIsPrintedAndLoggedOnce) {
  const auto count = [](const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
      ++found;
    return found;
  };
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--verbose"}}) {
    const Folder folder;
    const Ended run = run_hil(joined(
        {{"run", crossing(), "--out", folder / "out", "--set", "dut.command=[no-such-program]"}, more}));
    EXPECT_EQ(run.code, 4);
    EXPECT_EQ(count(run.output + run.errors, "no program 'no-such-program' was found"), 1U)
        << run.output << run.errors;
    EXPECT_EQ(run.output,
              "I/O failed: the reason is on stderr and in the report in " + (folder / "out") + "\n");
    EXPECT_EQ(count(read_text(folder / "out/run.log"), "'no-such-program'"), 1U);
    EXPECT_EQ(count(read_text(folder / "out/run.log"), "the run can not begin: "), 1U);
  }
}

TEST_F(RunFiles, RunThatCanNotBeginReplacesTheFilesOfTheEarlierRun) {
  const Folder folder;
  std::filesystem::copy(out(), folder / "out", std::filesystem::copy_options::recursive);
  ASSERT_TRUE(std::filesystem::exists(folder / "out/pictures/top-view.svg"));
  const Ended run =
      run_hil({"run", crossing(), "--out", folder / "out", "--set", "dut.command=[no-such-program]"});
  EXPECT_EQ(run.code, 4) << run.output << run.errors;
  EXPECT_NE(run.output.find("I/O failed: "), std::string::npos) << run.output;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "io_failed");
  EXPECT_EQ(report["exit_code"], 4);
  EXPECT_EQ(report["ticks"], 0);
  ASSERT_EQ(report["expectations"].size(), 3U);
  EXPECT_EQ(report["expectations"][0]["passed"], false);
  EXPECT_EQ(report["expectations"][0]["result"], "not_checked");
  const std::string junit = read_text(folder / "out/junit.xml");
  EXPECT_NE(junit.find("errors=\"1\""), std::string::npos) << junit;
  EXPECT_NE(junit.find("failures=\"3\""), std::string::npos) << junit;
  EXPECT_FALSE(std::filesystem::exists(folder / "out/pictures/top-view.svg"));
}

TEST(RunFolder, HasNoTraceIfTheScenarioWantsNone) {
  const Folder folder;
  write_text(folder / "s.yaml", "scenario: short\nbase_rate: 1 kHz\nduration: 50 ms\nclock: virtual\n");
  const auto run = [&](const std::vector<std::string>& more) {
    return run_hil(joined({{"run", folder / "s.yaml", "--out", folder / "out"}, more}));
  };
  const Ended with = run({});
  EXPECT_EQ(with.code, 0) << with.errors;
  EXPECT_EQ(with.errors, "hil run: the run begins: short, for 50 ms in virtual time; its folder is " +
                             (folder / "out") + "\n")
      << "its output is no terminal";
  EXPECT_TRUE(std::filesystem::exists(folder / "out/trace.json"));
  EXPECT_EQ(run({"--set", "trace=false"}).code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/report.json"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out/trace.json"));
}

/// As on a full disk: the trace is larger than a file may be here, the report is not.
TEST(RunFolder, TraceThatCanNotBeWrittenFailsTheRun) {
  const Folder folder;
  const Ended run = run_with_file_limit(1000, joined({{"run", crossing(), "--clock", "virtual", "--out",
                                                       folder / "out", "--set", "world.durability=volatile"},
                                                      few_beams()}));
  EXPECT_EQ(run.code, 4) << run.output << run.errors;
  EXPECT_NE(run.errors.find("can not be written: File too large"), std::string::npos) << run.errors;
  EXPECT_FALSE(run.output.empty()) << "the console reports the end of the run";
  ASSERT_TRUE(std::filesystem::exists(folder / "out/report.json"));
  EXPECT_EQ(read_report(folder / "out")["exit_code"], 4);
}

TEST_F(RunFiles, TraceHasTheRunsOfEveryTask) {
  const auto trace = nlohmann::json::parse(read_text(out("trace.json")), nullptr, false);
  ASSERT_FALSE(trace.is_discarded());
  std::set<std::string> tracks;
  std::size_t spans = 0;
  for (const auto& event : trace["traceEvents"]) {
    if (event["ph"] == "M" && event["name"] == "thread_name")
      tracks.insert(event["args"]["name"].get<std::string>());
    if (event["ph"] == "X") ++spans;
  }
  for (const char* task : {"traffic", "scanner", "detectors", "collision", "can.car", "modbus.plc"})
    EXPECT_EQ(tracks.count(task), 1U) << task;
  EXPECT_GT(spans, 1000U);
}

TEST_F(RunFiles, CanLogHasTheFramesThatTheReportCounts) {
  const auto frames = read_can_log(out("can-car.log"));
  const auto report = read_report(out());
  const auto& bus = report["can"][0];
  EXPECT_EQ(frames.size(), bus["rx"].get<std::size_t>() + bus["tx"].get<std::size_t>());
  std::int64_t before_ns = 0;
  for (const auto& frame : frames) {
    EXPECT_EQ(frame.interface, "car");
    ASSERT_GE(frame.frame.wall_ns, before_ns);
    before_ns = frame.frame.wall_ns;
  }
}

TEST(RunFolder, CanLogThatCanNotBeWrittenFailsTheRun) {
  const Folder folder;
  write_text(
      folder / "s.yaml",
      std::string("scenario: long log\nbase_rate: 1 kHz\nduration: 20 s\nclock: virtual\n"
                  "can: [{bus: car, database: \"") +
          HIL_SOURCE_DIR +
          "/configs/crossing/crossing.dbc\", rate: 1 kHz, send: [{message: EgoStatus, period: 1 ms}]}]\n");
  const Ended run = run_with_file_limit(400, {"run", folder / "s.yaml", "--out", folder / "out"});
  EXPECT_EQ(run.code, 4) << run.output << run.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "io_failed");
  EXPECT_EQ(report["exit_code"], 4);
  ASSERT_EQ(report["failures"].size(), 1U);
  EXPECT_EQ(report["failures"][0],
            "the CAN log '" + (folder / "out/can-car.log") + "' can not be written: File too large");
}

TEST(RunFolder, CanLogHasNoFramesThatFaultInjectionDropped) {
  const Folder folder;
  const Ended run = run_hil(joined({{"run", crossing(), "--clock", "virtual", "--duration", "2s", "--out",
                                     folder / "out", "--set", "can.car.faults={drop: 0.2}"},
                                    few_beams()}));
  ASSERT_EQ(run.code, 1) << "too few answers in 2 s: " << run.output << run.errors;
  const auto bus = read_report(folder / "out")["can"][0];
  const auto count = [&](const char* key) { return bus[key].get<std::size_t>(); };
  EXPECT_GT(count("fault_dropped_tx"), 100U);
  EXPECT_EQ(count("dropped"), 0U);
  EXPECT_EQ(read_can_log(folder / "out/can-car.log").size(),
            count("rx") + count("tx") - count("fault_dropped_tx"));
  EXPECT_NE(read_text(folder / "out/report.html").find("sent frames were dropped by fault injection"),
            std::string::npos);
}

}  // namespace
}  // namespace hil::scenario_test
