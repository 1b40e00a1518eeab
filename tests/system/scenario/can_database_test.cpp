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
  EXPECT_NE(ended.output.find("no mistakes, 3 warnings"), std::string::npos) << ended.output;
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

constexpr const char* gear_scenario = R"(
scenario: gears
base_rate: 1 kHz
duration: 100 ms
clock: virtual
tasks:
  - module: display
    type: block
    rate: 1 kHz
    inputs: {gear: can.car.Cmd.Gear}
    parameters: {inputs: {gear: {initial: 0}}, outputs: {drives: gear == D}}
  - {module: counter, type: block, rate: 1 kHz, parameters: {states: {x: {unit: s, derivative: 1}}}}
can:
  - {bus: car, device: virtual, database: bus.dbc, rate: 1 kHz, send: [{message: Cmd, period: 10 ms}]}
stimuli:
  - name: gear
    drives: can.car.Cmd.Gear
    sequence:
      - {hold: N, for: 20 ms}
      - {value: if counter.x > 35 ms then R else 'limp home', for: 30 ms}
      - {pulses: {low: P, high: D, period: 20 ms}}
faults:
  - {name: stuck, signal: can.car.Cmd.Gear, stuck: N, when: can.car.Cmd.Gear == D, for: 1 ms}
expectations:
  - {name: neutral first, always: can.car.Cmd.Gear == N, between: [0 s, 19 ms]}
  - {name: reverse, eventually: can.car.Cmd.Gear == R, by: 40 ms}
  - {name: faulty, eventually: can.car.Cmd.Gear.faulted == N and can.car.Cmd.Gear == D}
  - {name: displayed, eventually: display.drives == 1}
)";
constexpr const char* gear_database =
    "VERSION \"\"\nBU_: A B\nBO_ 256 Cmd: 8 A\n SG_ Gear : 0|8@1+ (1,0) [0|255] \"\" B\n"
    "VAL_ 256 Gear 0 \"P\" 1 \"R\" 2 \"N\" 3 \"D\" 9 \"limp home\" ;\n";

TEST(CanDatabase, ValueNamesOfSentSignalsAreWrittenAndCompared) {
  const Folder folder;
  write_text(folder / "bus.dbc", gear_database);
  write_text(folder / "bus.yaml", gear_scenario);
  const Ended ended = run_hil({"run", folder / "bus.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  std::vector<int> gears;
  for (const auto& logged : read_can_log(folder / "out/can-car.log"))
    gears.push_back(logged.frame.raw.data[0]);
  EXPECT_EQ(std::vector<int>(gears.begin(), gears.begin() + 10),
            (std::vector<int>{2, 2, 9, 9, 1, 2, 0, 3, 0, 3}))
      << "the fault makes the first D an N";
}

TEST(CanDatabase, UnknownValueNamesAreRefusedWithThoseThatAreThere) {
  const Folder folder;
  write_text(folder / "bus.dbc", gear_database);
  const std::string names = "D, N, P, R, limp home";
  const struct {
    std::string from, to, mistake;
  } all[] = {
      {"hold: N", "hold: Z", "'Z' is neither a number nor a signal, and 'can.car.Cmd.Gear' has no value"},
      {"high: D", "high: Z", "'Z' is neither a number nor a signal, and 'can.car.Cmd.Gear' has no value"},
      {"stuck: N", "stuck: Z", "'Z' is neither a number nor a signal, and 'can.car.Cmd.Gear' has no value"},
      {"Gear == D, for", "Gear == Z, for",
       "'Z' is no number and no signal, and 'can.car.Cmd.Gear' has no value"},
      {"Gear == R", "Gear == Z", "'Z' is no number and no signal, and 'can.car.Cmd.Gear' has no value"},
      {"gear == D", "gear == Z", "'Z' is no number and no "},
  };
  for (const auto& [from, to, mistake] : all) {
    std::string text = gear_scenario;
    text.replace(text.find(from), from.size(), to);
    write_text(folder / "bus.yaml", text);
    const Ended ended = run_hil({"check", folder / "bus.yaml"});
    EXPECT_EQ(ended.code, 2) << to;
    EXPECT_NE(ended.errors.find(mistake), std::string::npos) << ended.errors;
    EXPECT_NE(ended.errors.find(names), std::string::npos) << ended.errors;
  }
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
