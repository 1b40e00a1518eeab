#include "runtime/executive/host_pause_detector.hpp"

#include <gtest/gtest.h>

namespace hil::executive {
namespace {

constexpr std::int64_t ms = 1'000'000;

TEST(HostPauseDetector, OversleepingIsAPauseOfAThreadThatWasOffTheCpu) {
  HostPauseDetector pause_detector;
  EXPECT_EQ(pause_detector.pause_ns(0, 1'000 * ms, 1'000 * ms), 0) << "no evidence";
  pause_detector.note_sleep(100 * ms, 300 * ms, 0);
  EXPECT_EQ(pause_detector.pause_ns(95 * ms, 305 * ms, 205 * ms), 200 * ms);
  EXPECT_EQ(pause_detector.pause_ns(250 * ms, 400 * ms, 150 * ms), 50 * ms) << "only the overlap";
  EXPECT_EQ(pause_detector.pause_ns(300 * ms, 500 * ms, 200 * ms), 0) << "no overlap";
  EXPECT_EQ(pause_detector.pause_ns(100 * ms, 300 * ms, 1 * ms), 0) << "the thread ran";
  pause_detector.note_sleep(600 * ms, 601 * ms, 0);
  EXPECT_EQ(pause_detector.pause_ns(599 * ms, 602 * ms, 3 * ms), 0) << "ordinary scheduling";
}

TEST(HostPauseDetector, PauseOfTheProcessIsTimeInWhichNoThreadRan) {
  HostPauseDetector pause_detector;
  EXPECT_EQ(pause_detector.process_pause_ns(0, 1'000 * ms), 0);
  pause_detector.note_sleep(100 * ms, 300 * ms, 5 * ms);
  EXPECT_EQ(pause_detector.process_pause_ns(90 * ms, 310 * ms), 195 * ms);
  EXPECT_EQ(pause_detector.process_pause_ns(200 * ms, 310 * ms), 95 * ms)
      << "the process may have run at any time of the pause";
  EXPECT_EQ(pause_detector.process_pause_ns(297 * ms, 310 * ms), 0);
  EXPECT_EQ(pause_detector.process_pause_ns(310 * ms, 400 * ms), 0);
  pause_detector.note_sleep(500 * ms, 600 * ms, 180 * ms);
  EXPECT_EQ(pause_detector.process_pause_ns(500 * ms, 600 * ms), 0) << "only the detector did not run";
  pause_detector.note_sleep(700 * ms, 750 * ms, 0);
  EXPECT_EQ(pause_detector.process_pause_ns(0, 1'000 * ms), 245 * ms);
  pause_detector.note_steal(800 * ms, 0);
  pause_detector.note_steal(900 * ms, 50 * ms);
  EXPECT_EQ(pause_detector.process_pause_ns(800 * ms, 900 * ms), 0)
      << "the time may be stolen from another processor";
}

TEST(HostPauseDetector, StolenTimeIsAPause) {
  HostPauseDetector pause_detector;
  pause_detector.note_steal(100 * ms, 5'000 * ms);
  EXPECT_EQ(pause_detector.pause_ns(0, 200 * ms, 200 * ms), 0) << "the first reading is the reference";
  pause_detector.note_steal(120 * ms, 5'010 * ms);
  EXPECT_EQ(pause_detector.pause_ns(100 * ms, 120 * ms, 12 * ms), 10 * ms);
  EXPECT_EQ(pause_detector.pause_ns(100 * ms, 120 * ms, 6 * ms), 6 * ms);
  EXPECT_EQ(pause_detector.pause_ns(100 * ms, 120 * ms, 1 * ms), 0);
}

TEST(HostPauseDetector, OnlyTheOldestPausesAreDropped) {
  HostPauseDetector pause_detector;
  for (std::int64_t i = 0; i < 300; ++i)
    pause_detector.note_sleep(i * 100 * ms, i * 100 * ms + 50 * ms, 0);
  EXPECT_EQ(pause_detector.pause_ns(0, 60 * ms, 60 * ms), 0);
  EXPECT_EQ(pause_detector.pause_ns(29'900 * ms, 29'950 * ms, 50 * ms), 50 * ms);
}

}  // namespace
}  // namespace hil::executive
