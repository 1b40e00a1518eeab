// Logs that a bus plays: what is read of them, and their mistakes.

#include "runtime/buses/can/played_log.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tests/support/rounds.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text_mutator.hpp"

namespace hil::buses::can {
namespace {

class PlayedLogs : public ::testing::Test {
 protected:
  /// The playback of a log on a bus that sends the message with identifier 0x100, and whose database has
  /// further ones. Empty with mistakes.
  std::optional<io::can::PlaybackConfig> playback(const std::string& log, PlayedLog section = {}) {
    diagnostics_ = {};
    section.file = {folder_.write("drive.log", log), file_place};
    return read_played_log(section, identifiers, diagnostics_);
  }
  std::string texts() const {
    std::string text = diagnostics_.to_text();
    const std::string folder = folder_.path().string() + "/";
    for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
      text.erase(at, folder.size());
    return text;
  }

  static constexpr std::int64_t ms = 1'000'000;
  const BusIdentifiers identifiers{
      .sent = {0x100}, .known = {0x100, 0x123, 0x124, 0x200, 0x201, 0x202, 0x12345678U | CAN_EFF_FLAG}};
  const config::Place file_place{"scenario.yaml", 10, 18}, interface_place{"scenario.yaml", 10, 40},
      begin_place{"scenario.yaml", 10, 44}, every_place{"scenario.yaml", 10, 47};
  const tests::TemporaryFolder folder_;
  config::Diagnostics diagnostics_;
};

TEST_F(PlayedLogs, HaveTheFramesAtTheirOffsets) {
  const auto played = playback(
      "(1436509052.000000) vcan0 200#2A36\n\n(1436509052.010000) vcan0 12345678#R4\r\n"
      "(1436509052.025500) vcan0 123##1AABBCC\n");
  ASSERT_TRUE(played) << texts();
  EXPECT_EQ(texts(), "");
  EXPECT_EQ(played->name, "drive.log");
  EXPECT_EQ(played->begin_ns, 0);
  EXPECT_EQ(played->passes, 1U);
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
  const auto played = playback(log, {.interface = config::Word{"vcan0", interface_place},
                                     .begin_ns = 2'000 * ms,
                                     .repeat = 3,
                                     .every_ns = 2'000 * ms});
  ASSERT_TRUE(played) << texts();
  ASSERT_EQ(played->frames->size(), 1U);
  EXPECT_EQ(played->frames->front().offset_ns, 500 * ms) << "since the first line";
  EXPECT_EQ(played->begin_ns, 2'000 * ms);
  EXPECT_EQ(played->passes, 3U);
  EXPECT_EQ(played->pass_period_ns, 2'000 * ms);
  EXPECT_FALSE(playback(log));
  EXPECT_EQ(texts(),
            "scenario.yaml:10:18: the log has frames of vcan0 and vcan1; 'interface' has to name one\n");
  EXPECT_FALSE(playback(log, {.interface = config::Word{"vcan2", interface_place}}));
  EXPECT_NE(texts().find("scenario.yaml:10:40: the log has no frame of 'vcan2'; did you mean 'vcan0'?"),
            std::string::npos)
      << texts();
}

TEST_F(PlayedLogs, LeaveOutErrorFramesAndFramesThatTheRunSends) {
  const auto played = playback(
      "(0.000000) v 200#01\n(0.010000) v 100#0102\n(0.020000) v 100#0102\n(0.030000) v "
      "20000004#0004000000000000\n"
      "(0.040000) v 100#R\n");
  ASSERT_TRUE(played) << texts();
  EXPECT_EQ(played->frames->size(), 2U) << "a remote request of the run's message is of another station";
  EXPECT_EQ(
      texts(),
      "drive.log:2:1: warning: 2 frames are not played, the first in this line: the run sends the message "
      "itself\n"
      "drive.log:4:1: warning: this frame is not played: error frames can not be sent\n");
}

TEST_F(PlayedLogs, WarnOfFramesThatTheDatabaseDoesNotKnow) {
  const auto played = playback("(0.000000) v 200#01\n(0.010000) v 300#01\n(0.020000) v 00000200#R\n");
  ASSERT_TRUE(played) << texts();
  ASSERT_EQ(played->frames->size(), 3U);
  EXPECT_FALSE((*played->frames)[0].is_unknown);
  EXPECT_TRUE((*played->frames)[1].is_unknown);
  EXPECT_TRUE((*played->frames)[2].is_unknown) << "an extended identifier";
  EXPECT_EQ(texts(),
            "drive.log:2:1: warning: 2 frames are sent, but not received by the run, the first in this line: "
            "the database has no message with the identifier; add it there\n");
  EXPECT_FALSE(playback("(0.000000) v 100#01\n(0.010000) v 300#01\n(0.020000) v 301#01\n"));
  EXPECT_EQ(
      texts(),
      "scenario.yaml:10:18: no frame of the log that would be played has an identifier of the database, "
      "so the run would receive none of these 2; play a log of this bus, or use the database of the "
      "log\n");
}

TEST_F(PlayedLogs, BeginBeforeTheEndOfTheRun) {
  const std::string log = "(5.000000) w 200#01\n(5.500000) v 200#01\n(9.000000) v 200#01\n";
  PlayedLog section{.interface = config::Word{"v", interface_place},
                    .begin_ns = 1'499 * ms,
                    .begin_place = begin_place,
                    .run_ns = 2'000 * ms};
  EXPECT_TRUE(playback(log, section)) << texts();
  section.begin_ns = 1'500 * ms;
  EXPECT_FALSE(playback(log, section));
  EXPECT_EQ(texts(),
            "scenario.yaml:10:44: 'begin': no frame of the log would be sent: the first one is due at 2 s, "
            "which is not before the end of the run, which takes 2 s; give an earlier time or a longer "
            "duration\n");
  section.begin_ns = 1'495 * ms;
  EXPECT_TRUE(playback(log, section)) << "in real time a frame is sent between ticks " << texts();
  section.send_interval_ns = 10 * ms;
  EXPECT_FALSE(playback(log, section));
  EXPECT_EQ(
      texts(),
      "scenario.yaml:10:44: 'begin': no frame of the log would be sent: the first one is due at "
      "1995 ms, which is after the last instant at which the bus sends, 1990 ms; give an earlier time or a "
      "longer duration\n");
  section.run_ns = 0;
  EXPECT_TRUE(playback(log, section)) << "a run without an end";
}

TEST_F(PlayedLogs, MayBeSlightlyOutOfOrder) {
  const auto played = playback("(1.000000) v 200#01\n(1.050000) v 201#\n(1.049000) v 202#\n");
  ASSERT_TRUE(played) << texts();
  EXPECT_EQ((*played->frames)[2].offset_ns, 50 * ms);
  EXPECT_FALSE(playback("(9.000000) v 200#01\n(8.900000) v 202#\n(8.899000) v 201#\n"));
  EXPECT_EQ(
      texts(),
      "drive.log:3:1: this frame is 101 ms earlier than an earlier line of its interface; at most 100 ms are "
      "allowed, so sort the log by time\n");
}

TEST_F(PlayedLogs, HaveMistakesAtTheirPlaces) {
  const std::string form = "; a line of candump -l is as '(1436509052.249713) vcan0 044#2A36'\n";
  const struct {
    std::string log;
    PlayedLog section;
    std::string mistakes;
  } all[] = {
      {"", {}, "scenario.yaml:10:18: the log has no frame\n"},
      {"(0.0) v 100#01\n", {}, "drive.log:1:2: the time does not have six decimals" + form},
      {"(0.000000) v 200#01\nvcan0  123   [2]  11 22\n(0.100000) v 200#0\n",
       {},
       "drive.log:2:1: the line does not begin with a time in parentheses" + form +
           "drive.log:3:18: the payload has an odd number of hexadecimal digits" + form},
      {"(0.000000) v 100#01\n(0.000000) v 100#02\n",
       {},
       "scenario.yaml:10:18: no frame of the log is left to play: of its 2 frames, 2 are of messages under "
       "'send', which the run sends itself\n"},
      {"(0.000000) v 100#01\n(0.000000) v 20000004#00\n",
       {},
       "scenario.yaml:10:18: no frame of the log is left to play: of its 2 frames, 1 is of a message under "
       "'send', which the run sends itself, and 1 is an error frame, which can not be sent\n"},
      {"(0.000000) v 200#01\n",
       {.repeat = 0},
       "scenario.yaml:10:18: the frames of the log are at one instant; to repeat it, give 'every', the time "
       "from the start of a pass to the next one\n"},
      {"(0.000000) v 200#01\n(1.000000) v 200#01\n",
       {.repeat = 2, .every_ns = 500 * ms, .every_place = every_place},
       "scenario.yaml:10:47: 'every': 500 ms is shorter than the log, which takes 1 s\n"},
  };
  for (const auto& one : all) {
    EXPECT_FALSE(playback(one.log, one.section)) << one.log;
    EXPECT_EQ(texts(), one.mistakes) << one.log;
  }
}

TEST_F(PlayedLogs, ThatCanNotBeReadAreRefused) {
  EXPECT_FALSE(read_played_log({.file = {folder_.path().string(), file_place}}, identifiers, diagnostics_));
  EXPECT_EQ(diagnostics_.to_text(), "scenario.yaml:10:18: the log can not be read after its line 0\n")
      << "a read of a folder fails after it is open";
  diagnostics_ = {};
  EXPECT_FALSE(
      read_played_log({.file = {(folder_.path() / "none").string(), file_place}}, identifiers, diagnostics_));
  EXPECT_EQ(diagnostics_.to_text(), "scenario.yaml:10:18: the log can not be opened\n");
}

TEST_F(PlayedLogs, DamagedAreReadOrRefusedAtALine) {
  const std::string log =
      "(1436509052.000000) vcan0 200#2A36\n(1436509052.010000) vcan0 12345678#R4\n"
      "(1436509052.025500) vcan0 123##1AABBCC\n(1436509052.030000) vcan0 20000004#0004000000000000\n";
  std::uint64_t accepted = 0, refused = 0;
  const std::uint64_t rounds = tests::rounds(1000);
  for (std::uint64_t seed = 0; seed < rounds; ++seed) {
    const bool is_read = playback(tests::TextMutator(seed).mutate(log)).has_value();
    ASSERT_EQ(is_read, diagnostics_.empty()) << "seed " << seed << texts();
    for (const config::Mistake& mistake : diagnostics_.mistakes())
      ASSERT_GE(mistake.place.line, 1U) << "seed " << seed << ": " << mistake.message;
    ++(is_read ? accepted : refused);
  }
  EXPECT_GT(accepted, rounds / 20);
  EXPECT_GT(refused, rounds / 10);
}

}  // namespace
}  // namespace hil::buses::can
