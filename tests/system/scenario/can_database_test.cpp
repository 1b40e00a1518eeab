// Statements of a DBC file, seen by a user of the program.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

void write_files(const Folder& folder, const std::string& statements) {
  write_text(folder / "bus.dbc",
             "VERSION \"\"\nBU_: A B\nBO_ 256 Short: 8 A\n SG_ V : 0|8@1+ (1,0) [0|255] \"\" B\n"
             " SG_ W : 8|8@1+ (1,0) [0|255] \"\" B\nVAL_ 256 V 7 \"seven\" ;\n" +
                 statements);
  write_text(
      folder / "bus.yaml",
      "scenario: bus\nbase_rate: 1 kHz\nduration: 100 ms\nclock: virtual\nworld: {durability: volatile}\n"
      "can:\n  - bus: car\n    device: virtual\n    database: bus.dbc\n    rate: 100 Hz\n"
      "    send: [{message: Short, signals: {V: seven}}]\n");
}

TEST(CanDatabase, WarningsAreReportedAndRefuseNothing) {
  const Folder folder;
  write_files(folder, "CM_ \"unfinished\"\nBA_DEF_ BO_ \"X\" INT 0 1;\n");
  const Ended ended = run_hil({"check", folder / "bus.yaml"});
  EXPECT_EQ(ended.code, 0) << ended.errors;
  EXPECT_NE(ended.output.find("no mistakes, 2 warnings"), std::string::npos) << ended.output;
  EXPECT_NE(ended.errors.find("bus.dbc:7:1: warning: this statement has no ';' at its end"),
            std::string::npos)
      << ended.errors;
  EXPECT_NE(ended.errors.find("bus.yaml:11:22: warning: nothing sets these signals of Short"),
            std::string::npos)
      << ended.errors;
}

TEST(CanDatabase, FdMessageIsSentAsFdFrameWithItsCycleTime) {
  const Folder folder;
  write_files(folder,
              "BA_DEF_DEF_ \"CANFD_BRS\" \"1\";\nBA_ \"VFrameFormat\" BO_ 256 14;\nBA_ \"GenMsgCycleTime\" "
              "BO_ 256 20;\n"
              "BA_ \"GenSigStartValue\" SG_ 256 W 9;\n");
  const Ended ended = run_hil({"run", folder / "bus.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  EXPECT_EQ(ended.errors.find("warning"), std::string::npos) << ended.errors;
  const std::string log = read_text(folder / "out/can-car.log");
  EXPECT_NE(log.find(" 100##10709000000000000\n"), std::string::npos) << log;
  const auto frames = read_can_log(folder / "out/can-car.log");
  ASSERT_GE(frames.size(), 5U);
  EXPECT_EQ(frames[1].frame.wall_ns - frames[0].frame.wall_ns, 20'000'000);
}

/// A car at 10 m/s, whose speed is sent in km/h.
TEST(CanDatabase, SignalsAreSentInTheUnitOfTheDatabase) {
  const Folder folder;
  write_text(folder / "bus.dbc",
             "VERSION \"\"\nBU_: A B\nBO_ 256 Status: 8 A\n SG_ Speed : 0|8@1+ (1,0) [0|255] \"km/h\" B\n");
  write_text(
      folder / "bus.yaml",
      "scenario: bus\nbase_rate: 1 kHz\nduration: 100 ms\nclock: virtual\nworld: {durability: volatile}\n"
      "tasks:\n  - module: traffic\n    type: vehicles\n    rate: 100 Hz\n"
      "    parameters: {vehicles: {ego: {position: [0 m, 0 m], speed: 10 m/s}}}\n"
      "can:\n  - bus: car\n    device: virtual\n    database: bus.dbc\n    rate: 100 Hz\n"
      "    send: [{message: Status, signals: {Speed: traffic.ego.speed}}]\n"
      "faults: [{name: late, task: traffic, takes_longer: 1 us, when: traffic.ego.speed > 1 m/s}]\n"
      "expectations: [{name: drives, always: traffic.ego.speed > 1 m/s}]\n");
  const Ended checked = run_hil({"check", folder / "bus.yaml", "--signals"});
  EXPECT_EQ(checked.code, 0) << checked.errors;
  EXPECT_NE(checked.output.find("can.car.Status.Speed (in km/h), fault late, 1 expectation\n"),
            std::string::npos)
      << checked.output;
  const Ended ended = run_hil({"run", folder / "bus.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto frames = read_can_log(folder / "out/can-car.log");
  ASSERT_GE(frames.size(), 5U);
  EXPECT_EQ(frames[3].frame.payload()[0], 36);
}

}  // namespace
}  // namespace hil::scenario_test
