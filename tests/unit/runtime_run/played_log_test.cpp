// Logs as the source of a bus: what is read of them, and their mistakes.

#include <gtest/gtest.h>

#include <string>

#include "runtime/buses/can/can_wiring.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"
#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::run {
namespace {

class PlayedLogs : public test::WiringFixture {
 protected:
  /// The playback of a log; `keys`: further ones of `play`. Null with mistakes.
  const io::can::PlaybackConfig* playback(const std::string& log, const std::string& keys = "") {
    folder_.write("drive.log", log);
    folder_.write("bus.dbc",
                  "VERSION \"\"\nBU_: A B\nBO_ 256 Status: 2 A\n SG_ V : 0|8@1+ (1,0) [0|255] \"\" B\n"
                  "BO_ 512 Command: 2 B\n SG_ W : 0|8@1+ (1,0) [0|255] \"\" A\n");
    wiring_ = wired(
        "scenario: s\nbase_rate: 1 kHz\nduration: 1 s\ncan:\n"
        "  - bus: car\n    database: bus.dbc\n    rate: 100 Hz\n    send: [{message: Status, signals: {V: "
        "1}}]\n"
        "    receive: [{message: Command, timeout: 0 ms}]\n    play: {file: drive.log" +
        keys + "}\n");
    if (!wiring_) return nullptr;
    const auto& can = dynamic_cast<const buses::can::CanWiring&>(*wiring_->buses[0].bus);
    return can.config().playback ? &*can.config().playback : nullptr;
  }
  std::string texts() const {
    std::string text = diagnostics_.to_text();
    const std::string folder = folder_.path().string() + "/";
    for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
      text.erase(at, folder.size());
    return text;
  }

  static constexpr std::int64_t ms = 1'000'000;
  std::optional<Wiring> wiring_;
};

TEST_F(PlayedLogs, HaveTheFramesAtTheirOffsets) {
  const auto* const played = playback(
      "(1436509052.000000) vcan0 200#2A36\n\n(1436509052.010000) vcan0 12345678#R4\r\n"
      "(1436509052.025500) vcan0 123##1AABBCC\n");
  ASSERT_NE(played, nullptr) << texts();
  EXPECT_EQ(texts(), "");
  EXPECT_EQ(played->name, "drive.log");
  EXPECT_EQ(played->begin_ns, 0);
  EXPECT_EQ(played->rounds, 1U);
  const auto& frames = *played->frames;
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].offset_ns, 0);
  EXPECT_EQ(frames[0].raw.can_id, 0x200U);
  EXPECT_EQ(frames[0].raw.len, 2U);
  EXPECT_EQ(frames[1].offset_ns, 10 * ms);
  EXPECT_EQ(frames[1].raw.can_id, 0x12345678U | CAN_EFF_FLAG | CAN_RTR_FLAG);
  EXPECT_EQ(frames[2].offset_ns, 25'500'000);
  EXPECT_TRUE(frames[2].is_fd);
  EXPECT_EQ(frames[2].raw.flags, 1U);
}

TEST_F(PlayedLogs, AreOfOneInterface) {
  const std::string log = "(10.000000) vcan1 123#\n(10.500000) vcan0 200#00\n(11.000000) vcan1 124#\n";
  const auto* const played = playback(log, ", interface: vcan0, begin: 2 s, repeat: 3, every: 2 s");
  ASSERT_NE(played, nullptr) << texts();
  ASSERT_EQ(played->frames->size(), 1U);
  EXPECT_EQ(played->frames->front().offset_ns, 500 * ms) << "since the first line";
  EXPECT_EQ(played->begin_ns, 2'000 * ms);
  EXPECT_EQ(played->rounds, 3U);
  EXPECT_EQ(played->round_ns, 2'000 * ms);
  EXPECT_EQ(playback(log), nullptr);
  EXPECT_EQ(texts(),
            "scenario.yaml:10:18: the log has frames of vcan0 and vcan1; 'interface' has to name one\n");
  EXPECT_EQ(playback(log, ", interface: vcan2"), nullptr);
  EXPECT_NE(texts().find("scenario.yaml:10:40: the log has no frame of 'vcan2'; did you mean 'vcan0'?"),
            std::string::npos)
      << texts();
}

TEST_F(PlayedLogs, LeaveOutErrorFramesAndFramesThatTheRunSends) {
  const auto* const played = playback(
      "(0.000000) v 200#01\n(0.010000) v 100#0102\n(0.020000) v 100#0102\n(0.030000) v "
      "20000004#0004000000000000\n"
      "(0.040000) v 100#R\n");
  ASSERT_NE(played, nullptr) << texts();
  EXPECT_EQ(played->frames->size(), 2U) << "a remote request of the run's message is of another station";
  EXPECT_EQ(
      texts(),
      "drive.log:2:1: warning: 2 frames are not played, the first in this line: the run sends the message "
      "itself\n"
      "drive.log:4:1: warning: this frame is not played: error frames can not be sent\n");
}

TEST_F(PlayedLogs, MayBeSlightlyOutOfOrder) {
  const auto* const played = playback("(1.000000) v 200#01\n(1.050000) v 201#\n(1.049000) v 202#\n");
  ASSERT_NE(played, nullptr) << texts();
  EXPECT_EQ((*played->frames)[2].offset_ns, 50 * ms);
  EXPECT_EQ(playback("(9.000000) v 200#01\n(8.500000) v 201#\n"), nullptr);
  EXPECT_EQ(texts(), "drive.log:2:1: this frame is 500 ms before the one in the line before it\n");
}

TEST_F(PlayedLogs, HaveMistakesAtTheirPlaces) {
  const std::string form =
      "this is no frame in the form of candump -l, as '(1436509052.249713) vcan0 044#2A36'\n";
  const struct {
    std::string log, keys, mistakes;
  } all[] = {
      {"", "", "scenario.yaml:10:18: the log has no frame to play\n"},
      {"(0.0) v 100#01\n", "", "drive.log:1:1: " + form},
      {"(0.000000) v 200#01\nvcan0  123   [2]  11 22\n(0.100000) v 200#0\n", "",
       "drive.log:2:1: " + form + "drive.log:3:1: " + form},
      {"(0.000000) v 200#010203040506070809\n", "", "drive.log:1:1: " + form},
      {"(0.000000) v 100#01\n", "", "scenario.yaml:10:18: the log has no frame to play\n"},
      {"(0.000000) v 200#01\n", ", repeat: 0",
       "scenario.yaml:10:18: the frames of the log are at one instant; to repeat it, give 'every', the time "
       "from "
       "one begin to the next\n"},
      {"(0.000000) v 200#01\n(1.000000) v 200#01\n", ", repeat: 2, every: 500 ms",
       "scenario.yaml:10:47: 'every': 500 ms is shorter than the log, which takes 1 s\n"},
  };
  for (const auto& one : all) {
    EXPECT_EQ(playback(one.log, one.keys), nullptr) << one.log;
    EXPECT_EQ(texts(), one.mistakes) << one.log;
  }
}

TEST_F(PlayedLogs, DamagedAreReadOrRefusedAtALine) {
  const std::string log =
      "(1436509052.000000) vcan0 200#2A36\n(1436509052.010000) vcan0 12345678#R4\n"
      "(1436509052.025500) vcan0 123##1AABBCC\n(1436509052.030000) vcan0 20000004#0004000000000000\n";
  std::uint64_t accepted = 0, refused = 0;
  const std::uint64_t rounds = tests::rounds(1000);
  for (std::uint64_t seed = 0; seed < rounds; ++seed) {
    const bool is_read = playback(tests::TextMutator(seed).mutate(log)) != nullptr;
    ASSERT_EQ(is_read, diagnostics_.empty()) << "seed " << seed << texts();
    for (const config::Mistake& mistake : diagnostics_.mistakes())
      ASSERT_GE(mistake.place.line, 1U) << "seed " << seed << ": " << mistake.message;
    ++(is_read ? accepted : refused);
  }
  EXPECT_GT(accepted, rounds / 20);
  EXPECT_GT(refused, rounds / 10);
}

}  // namespace
}  // namespace hil::run
