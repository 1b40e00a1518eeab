// When frames of a log are due, and what a playback counts.

#include "io/can/log_playback.hpp"

#include <gtest/gtest.h>

#include <string>

namespace hil::io::can {
namespace {

constexpr std::int64_t ms = 1'000'000;

canfd_frame frame_of(canid_t id, std::uint8_t byte) {
  canfd_frame frame{};
  frame.can_id = id;
  frame.len = 1;
  frame.data[0] = byte;
  return frame;
}

PlayedFrame played(std::int64_t offset_ns, canid_t id, std::uint8_t byte) {
  return {.offset_ns = offset_ns, .raw = frame_of(id, byte)};
}

PlaybackConfig log_of(std::vector<PlayedFrame> frames, RunTimeNs begin_ns = 0, std::uint64_t passes = 1,
                      std::int64_t pass_period_ns = 0) {
  return {.name = "drive.log",
          .frames = std::make_shared<const std::vector<PlayedFrame>>(std::move(frames)),
          .begin_ns = begin_ns,
          .pass_period_ns = pass_period_ns,
          .passes = passes};
}

/// The bytes of the frames that are due up to an instant.
std::string due_up_to(LogPlayback& playback, RunTimeNs now_ns) {
  std::string bytes;
  while (const PlayedFrame* due = playback.due(now_ns)) {
    bytes += static_cast<char>(due->raw.data[0]);
    playback.sent(now_ns);
  }
  return bytes;
}

TEST(LogPlayback, CountsUnknownFramesThatAreSent) {
  std::vector<PlayedFrame> frames{played(0, 1, 'a'), played(0, 2, 'b'), played(0, 3, 'c')};
  frames[1].is_unknown = frames[2].is_unknown = true;
  LogPlayback playback(log_of(frames));
  playback.sent(0);
  playback.sent(0);
  playback.drop(0);
  EXPECT_EQ(playback.state().sent, 2U);
  EXPECT_EQ(playback.state().sent_unknown, 1U);
}

TEST(LogPlayback, GivesEachFrameAtItsTime) {
  LogPlayback playback(log_of({played(0, 1, 'a'), played(5 * ms, 1, 'b'), played(5 * ms, 2, 'c')}, 10 * ms));
  EXPECT_EQ(playback.next_due_ns(), 10 * ms);
  EXPECT_EQ(due_up_to(playback, 10 * ms - 1), "");
  EXPECT_EQ(due_up_to(playback, 10 * ms), "a");
  EXPECT_EQ(playback.next_due_ns(), 15 * ms);
  EXPECT_EQ(due_up_to(playback, 20 * ms), "bc");
  EXPECT_EQ(playback.next_due_ns(), std::nullopt);
  EXPECT_TRUE(playback.is_complete());
  const PlaybackState state = playback.state();
  EXPECT_EQ(state.passes, 1U);
  EXPECT_EQ(state.sent, 3U);
  EXPECT_EQ(state.first_ns, 10 * ms);
  EXPECT_EQ(state.last_ns, 20 * ms);
}

TEST(LogPlayback, RepeatsInPasses) {
  LogPlayback twice(log_of({played(0, 1, 'a'), played(5 * ms, 1, 'b')}, 0, 2, 10 * ms));
  EXPECT_EQ(due_up_to(twice, 9 * ms), "ab");
  EXPECT_EQ(twice.next_due_ns(), 10 * ms);
  EXPECT_EQ(due_up_to(twice, 100 * ms), "ab");
  EXPECT_TRUE(twice.is_complete());
  LogPlayback always(log_of({played(2 * ms, 1, 'a')}, 0, 0, 5 * ms));
  EXPECT_EQ(due_up_to(always, 5'000 * ms).size(), 1000U);
  EXPECT_FALSE(always.is_complete());
  EXPECT_EQ(always.state().passes, 1000U);
  always.cancel();
  EXPECT_EQ(always.next_due_ns(), std::nullopt);
}

TEST(LogPlayback, TriesAgainWhereTheQueueIsFull) {
  LogPlayback playback(log_of({played(0, 1, 'a'), played(1 * ms, 1, 'b')}));
  ASSERT_NE(playback.due(0), nullptr);
  EXPECT_TRUE(playback.retry(0));
  EXPECT_EQ(playback.due(0), nullptr);
  EXPECT_EQ(playback.next_due_ns(), 500'000);
  ASSERT_NE(playback.due(101 * ms), nullptr);
  EXPECT_FALSE(playback.retry(101 * ms)) << "too late";
  EXPECT_EQ(due_up_to(playback, 101 * ms), "b");
  EXPECT_EQ(playback.state().dropped, 1U);
  EXPECT_EQ(playback.state().sent, 1U);
}

}  // namespace
}  // namespace hil::io::can
