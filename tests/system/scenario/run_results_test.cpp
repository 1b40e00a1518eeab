// The results that a run reports agree with what it did.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// The entry of a list in report.json with this name.
nlohmann::json named(const nlohmann::json& list, const std::string& name) {
  for (const nlohmann::json& entry : list)
    if (entry["name"] == name) return entry;
  ADD_FAILURE() << "no entry has the name " << name;
  return {};
}

TEST(RunResults, QueuedRunReadsTheWorldOfItsRelease) {
  const Folder folder;
  // More beams than a machine computes in time, of a sensor on a car whose row is written in each run of its
  // task.
  write_text(folder / "queue.yaml", R"(
scenario: queue
base_rate: 1 kHz
duration: 1 s
tasks:
  - module: traffic
    type: vehicles
    rate: 100 Hz
    parameters: {vehicles: {a: {position: [0 m, 0 m], speed: 10 m/s}, b: {position: [20 m, 0 m], speed: 10 m/s}}}
  - module: scanner
    type: laser_scanner
    rate: 10 Hz
    thread: s
    overrun: queue
    parameters: {carrier: traffic.a, mount: [0 m, 0 m, 3 m], columns: 4000, rows: 4000, vertical: 170 deg, layers: [vehicle], object_layers: [vehicle], scan_rate: 1 Hz}
)");
  const Ended ended =
      run_hil(joined({{"run", folder / "queue.yaml", "--out", folder / "out"}, relaxed_timing()}));
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  const auto scanner = named(report["tasks"], "scanner");
  ASSERT_GT(scanner["overruns"].get<int>(), 0) << "no release was queued";
  EXPECT_GT(scanner["runs"].get<int>(), 1);
  EXPECT_EQ(scanner["without_result"], 0);
  EXPECT_EQ(report["transactions"]["bad_input"], 0);
}

/// A folder with the reports of a run that passed.
void leave_reports(const Folder& folder) {
  std::filesystem::create_directories(folder / "out");
  for (const char* file : {"report.json", "report.html", "junit.xml", "world.json"})
    write_text(folder / "out/" + file, "passed");
}

TEST(RunResults, RefusedScenarioRemovesTheReportOfAnEarlierRun) {
  for (const std::vector<std::string>& mistake : {std::vector<std::string>{"--set", "base_rat=1"},
                                                  std::vector<std::string>{"--fail-on", "mises > 0"}}) {
    const Folder folder;
    leave_reports(folder);
    std::filesystem::create_directories(folder / "out/database");
    write_text(folder / "out/database/segment.0000000001", "its history");
    write_text(folder / "out/world.json", "{}");
    const Ended ended = run_hil(joined({{"run", crossing(), "--out", folder / "out"}, mistake}));
    EXPECT_EQ(ended.code, 2) << ended.output << ended.errors;
    for (const char* report : {"report.json", "report.html"})
      EXPECT_FALSE(std::filesystem::exists(folder / "out/" + report)) << report;
    EXPECT_NE(read_text(folder / "out/junit.xml").find("<error "), std::string::npos);
    EXPECT_EQ(read_text(folder / "out/database/segment.0000000001"), "its history");
    EXPECT_TRUE(std::filesystem::exists(folder / "out/world.json"));
  }
}

TEST(RunResults, FilesOfTheUserInTheLogAreReportedAndKept) {
  const Folder folder;
  leave_reports(folder);
  std::filesystem::create_directories(folder / "out/database");
  write_text(folder / "out/database/thesis.txt", "of the user");
  const Ended ended = run_hil({"run", crossing(), "--out", folder / "out"});
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  EXPECT_EQ(read_text(folder / "out/database/thesis.txt"), "of the user");
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "io_failed");
  EXPECT_EQ(report["exit_code"], 4);
  EXPECT_NE(report["reason"].get<std::string>().find("thesis.txt"), std::string::npos) << report["reason"];
  EXPECT_NE(read_text(folder / "out/junit.xml").find("<error"), std::string::npos);
}

/// A body among `bodies` that it touches.
std::string crowd(int bodies) {
  std::string text =
      "scenario: crowd\nbase_rate: 100 Hz\nduration: 100 ms\nclock: virtual\nworld:\n  entities:\n"
      "    - {name: hub, shape: {sphere: 1 m}, mask: [hub]}\n";
  for (int i = 0; i < bodies; ++i)
    text += "    - {name: b" + std::to_string(i) + ", shape: {sphere: 0.5 m}, mask: [crowd]}\n";
  return text +
         "tasks:\n  - {module: c, type: collision, rate: 100 Hz, parameters: {body: hub, against: "
         "[crowd]}}\n";
}

TEST(RunResults, EveryCollisionIsCounted) {
  for (const int bodies : {40, 1'100}) {
    const Folder folder;
    write_text(folder / "crowd.yaml", crowd(bodies));
    const Ended ended = run_hil({"run", folder / "crowd.yaml", "--out", folder / "out"});
    EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
    const Signals signals(folder / "out");
    EXPECT_EQ(signals["c.hits"].back(), bodies);
    EXPECT_EQ(signals["c.total"].back(), bodies);
    bool reported = false;
    const auto report = read_report(folder / "out");
    for (const nlohmann::json& event : report["events"])
      reported = reported || event["text"].get<std::string>().find("more than the 1024") != std::string::npos;
    EXPECT_EQ(reported, bodies > 1024);
  }
}

TEST(FailOn, ConditionThatHoldsIsExitCode3) {
  const Folder folder;
  const std::vector<std::string> short_run =
      joined({{"run", crossing(), "--clock", "virtual", "--set", "expectations=[]", "--duration", "500 ms",
               "--out", folder / "out"},
              few_beams()});
  const Ended broken = run_hil(joined({short_run, {"--fail-on", "misses >= 0"}}));
  EXPECT_EQ(broken.code, 3) << broken.output << broken.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "timing_broken");
  EXPECT_NE(report["reason"].get<std::string>().find("misses >= 0"), std::string::npos) << report["reason"];
  const Ended kept = run_hil(joined({short_run, {"--fail-on", "misses > 0 or hard_misses > 0"}}));
  EXPECT_EQ(kept.code, 0) << "the virtual clock misses nothing\n" << kept.output << kept.errors;
}

TEST(RunResults, ReportThatCanNotBeWrittenIsWrittenAgainAsAFailure) {
  const Folder folder;
  // A folder of this name, which the first attempt removes.
  std::filesystem::create_directories(folder / "out/report.json.part");
  write_text(folder / "crowd.yaml", crowd(1));
  const Ended once = run_hil({"run", folder / "crowd.yaml", "--out", folder / "out"});
  EXPECT_EQ(once.code, 4) << once.output << once.errors;
  EXPECT_TRUE(once.output.starts_with("I/O failed: ")) << once.output;
  EXPECT_NE(once.output.find("report in"), std::string::npos) << "the second attempt succeeded";
  EXPECT_EQ(read_report(folder / "out")["exit_code"], 4);
  EXPECT_NE(read_text(folder / "out/run.log").find("exit code 4: "), std::string::npos);
}

TEST(RunResults, OutputThatCanNotBeWrittenIsExitCode4) {
  const Folder folder;
  write_text(folder / "crowd.yaml", crowd(1));
  Program run(
      {"sh", "-c",
       built("hil") + " run " + (folder / "crowd.yaml") + " --out " + (folder / "out") + " > /dev/full"});
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 4) << ended.errors;
  EXPECT_NE(ended.errors.find("the output can not be written"), std::string::npos) << ended.errors;
  EXPECT_NE(read_text(folder / "out/run.log").find("exit code 4: "), std::string::npos);
}

}  // namespace
}  // namespace hil::scenario_test
