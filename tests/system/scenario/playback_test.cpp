// A log that a CAN bus plays: a recorded drive moves a block, at exact instants.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

struct PlaybackScenario : ScenarioFolder {
  explicit PlaybackScenario(const std::string& play = "{file: drive.log, begin: 100 ms}")
      : ScenarioFolder(
            "scenario: recorded drive\nbase_rate: 1 kHz\nduration: 500 ms\nclock: virtual\n"
            "can:\n  - bus: car\n    database: bus.dbc\n    rate: 1 kHz\n"
            "    send: [{message: Status, period: 100 ms, signals: {V: reader.twice}}]\n"
            "    receive: [{message: Command, timeout: 120 ms}]\n    play: " +
            play +
            "\ntasks:\n  - module: reader\n    type: block\n    rate: 1 kHz\n"
            "    inputs: {w: can.car.Command.W}\n"
            "    parameters: {inputs: {w: '1'}, outputs: {twice: 2 * w, drives: w == Drive}}\n"
            "expectations:\n"
            "  - {name: first, always: can.car.Command.W == 5, between: [101 ms, 149 ms]}\n"
            "  - {name: second, always: can.car.Command.W == 7, between: [151 ms, 270 ms]}\n"
            "  - {name: stale, never: known(can.car.Command.W), between: [272 ms, 299 ms]}\n"
            "  - {name: by name, eventually: reader.drives == 1, by: 151 ms}\n"
            "  - {name: not before, never: reader.drives == 1, between: [0 s, 150 ms]}\n"
            "  - {name: third, always: can.car.Command.W == 9, between: [301 ms, 420 ms]}\n") {
    write_text(folder / "bus.dbc",
               "VERSION \"\"\nBU_: A B\nBO_ 512 Command: 2 B\n SG_ W : 0|8@1+ (1,0) [0|255] \"\" A\n"
               "BO_ 256 Status: 1 A\n SG_ V : 0|8@1+ (1,0) [0|255] \"\" B\n"
               "VAL_ 512 W 5 \"Park\" 7 \"Drive\" ;\n");
    write_text(folder / "drive.log",
               "(1436509052.000000) vcan0 200#0500\n"
               "(1436509052.012000) vcan0 555#11\n"
               "(1436509052.050000) vcan0 200#0700\n"
               "(1436509052.200000) vcan0 200#0900\n");
  }
};

TEST(CanPlayback, FramesComeAtTheBeginAndTheirOffsets) {
  const PlaybackScenario files;
  const Ended ended = files.run("out");
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  std::string frames;
  for (const auto& logged : read_can_log(files.folder / "out/can-car.log")) {
    if (logged.frame.raw.can_id == 0x100) continue;
    frames += std::to_string(logged.frame.wall_ns / 1'000'000) + ":" +
              std::to_string(logged.frame.raw.can_id) + "=" + std::to_string(logged.frame.raw.data[0]) + " ";
  }
  EXPECT_EQ(frames, "100:512=5 112:1365=17 150:512=7 300:512=9 ");
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(events_in_ms(report),
            "100 log drive.log begins on CAN bus car\n"
            "300 log drive.log ends on CAN bus car\n");
  ASSERT_EQ(report["stimuli"].size(), 1U);
  const auto& source = report["stimuli"][0];
  EXPECT_EQ(source["name"], "can.car");
  EXPECT_EQ(source["effect"], "plays drive.log");
  EXPECT_EQ(source["begins"], 1);
  EXPECT_EQ(source["first_begin_ns"], 100'000'000);
  EXPECT_EQ(source["active_ns"], 200'000'000);
  EXPECT_EQ(source["frames"], 4);
  EXPECT_EQ(report["can"][0]["played"], 4);
  EXPECT_EQ(report["can"][0]["play_unsent"], 0);
  EXPECT_EQ(report["can"][0]["play_unknown_id"], 1);
  EXPECT_EQ(report["can"][0]["unknown_id"], 1);
}

TEST(CanPlayback, FaultsOfAnIdentifierChangeFramesThatNoMessageDescribes) {
  const PlaybackScenario files;
  write_text(files.folder / "faulty.yaml",
             "scenario: faulty drive\ninclude: [s.yaml]\nfaults:\n"
             "  - {name: flipped, message: can.car.0x555, flip_bits: [1]}\n"
             "  - {name: late, message: can.car.0x555, delay: 5 ms}\n"
             "  - {name: by_number, message: can.car.0x200, length: 1, at: 280 ms}\n");
  const Ended ended = run_hil({"run", files.folder / "faulty.yaml", "--out", files.folder / "out"});
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  std::string frames;
  for (const auto& logged : read_can_log(files.folder / "out/can-car.log")) {
    if (logged.frame.raw.can_id == 0x555)
      frames +=
          std::to_string(logged.frame.wall_ns / 1'000'000) + "=" + std::to_string(logged.frame.raw.data[0]);
  }
  EXPECT_EQ(frames, "117=19") << "5 ms later, and 0x11 with bit 1 inverted";
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(report["can"][0]["played"], 4);
  for (const auto& fault : report["faults"])
    EXPECT_EQ(fault["frames"], 1) << fault.dump();
}

TEST(CanPlayback, FaultsOfAnIdentifierThatIsNotThereAreRefused) {
  const PlaybackScenario files;
  const auto mistakes_of = [&](const std::string& fault) {
    write_text(files.folder / "faulty.yaml",
               "scenario: faulty drive\ninclude: [s.yaml]\nfaults: [{name: f, " + fault + "}]\n");
    const Ended ended = run_hil({"check", files.folder / "faulty.yaml"});
    EXPECT_EQ(ended.code, 2) << ended.output;
    return ended.output + ended.errors;
  };
  EXPECT_NE(
      mistakes_of("message: can.car.0x556, drop: 100 %")
          .find("fault 'f' of 'can.car.0x556': the bus neither sends nor receives nor plays this message"),
      std::string::npos);
  EXPECT_NE(mistakes_of("message: can.car.0x555, wrong: counter").find("only a message of the DBC file"),
            std::string::npos);
  EXPECT_NE(mistakes_of("message: 0x555, drop: 100 %").find("is no message of a bus; it begins with the bus"),
            std::string::npos);
}

TEST(CanPlayback, RepeatsToTheEnd) {
  const PlaybackScenario files("{file: drive.log, repeat: 0, every: 210 ms}");
  ASSERT_EQ(files.run("out", {"--set", "expectations=[]"}).code, 0);
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(report["stimuli"][0]["begins"], 3);
  EXPECT_EQ(report["stimuli"][0]["frames"], 11);
}

TEST(CanPlayback, RunsAreByteForByteAlike) {
  const PlaybackScenario files;
  ASSERT_EQ(files.run("one").code, 0);
  ASSERT_EQ(files.run("two").code, 0);
  for (const char* const name : {"signals.csv", "can-car.log"})
    EXPECT_EQ(read_text(files.folder / (std::string("one/") + name)),
              read_text(files.folder / (std::string("two/") + name)));
}

TEST(CanPlayback, ThatBeginsAfterTheLastTickIsRefused) {
  const PlaybackScenario files;
  const auto errors_of = [&](const std::string& begin) {
    const Ended ended = run_hil({"check", files.folder / "s.yaml", "--set", "can.car.play.begin=" + begin,
                                 "--set", "expectations=[]"});
    EXPECT_EQ(ended.code, 2) << begin;
    return ended.errors;
  };
  EXPECT_NE(
      errors_of("2 s").find("the first one is due at 2 s, which is not before the end of the run, which "
                            "takes 500 ms"),
      std::string::npos);
  EXPECT_NE(errors_of("499.5 ms")
                .find("the first one is due at 499.5 ms, which is after the last instant at which the bus "
                      "sends, 499 ms; give an earlier time"),
            std::string::npos);
}

TEST(CanPlayback, HasBadLinesFoundByCheck) {
  const PlaybackScenario files;
  write_text(files.folder / "drive.log",
             "(1.000000) vcan0 200#0500\n(1.100000) vcan0 200#05 00\nvcan0 200#1\n");
  const Ended ended = run_hil({"check", files.folder / "s.yaml"});
  EXPECT_EQ(ended.code, 2);
  EXPECT_NE(ended.errors.find("drive.log:3:1: the line does not begin with a time in parentheses"),
            std::string::npos)
      << ended.errors;
}

}  // namespace
}  // namespace hil::scenario_test
