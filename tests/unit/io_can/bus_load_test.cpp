#include <gtest/gtest.h>

#include <cmath>

#include "io/can/can_counters.hpp"

namespace hil::io::can {
namespace {

constexpr RunTimeNs ms = 1'000'000;

/// 47 bits and one byte: 55, on a bus where 5500 bits are a tenth of a second.
constexpr double bits_per_second = 55'000.0;
Frame frame_at(RunTimeNs time_ns) {
  Frame frame;
  frame.raw.len = 1;
  frame.time_ns = time_ns;
  return frame;
}

void send(BusLoadMeter& meter, RunTimeNs from_ns, int frames) {
  for (int i = 0; i < frames; ++i)
    meter.add(frame_at(from_ns + i * ms / 4));
}

TEST(BusLoad, CountsWholeWindowsOnly) {
  BusLoadMeter meter(bits_per_second);
  send(meter, 0, 50);
  meter.advance(99 * ms);
  EXPECT_TRUE(std::isnan(meter.mean())) << "no complete window";
  EXPECT_EQ(meter.peak(), 0.0);
  meter.advance(100 * ms);
  EXPECT_DOUBLE_EQ(meter.mean(), 0.5);
  EXPECT_DOUBLE_EQ(meter.latest(), 0.5);
  send(meter, 100 * ms, 20);
  send(meter, 200 * ms, 90);  // the end of the run cuts this window
  EXPECT_DOUBLE_EQ(meter.mean(), 0.35);
  EXPECT_DOUBLE_EQ(meter.peak(), 0.5);
  EXPECT_DOUBLE_EQ(meter.latest(), 0.2);
}

TEST(BusLoad, MeanIncludesSilentWindows) {
  BusLoadMeter meter(bits_per_second);
  send(meter, 0, 80);
  send(meter, 300 * ms, 1);
  EXPECT_DOUBLE_EQ(meter.mean(), 0.8 / 3.0);
  EXPECT_DOUBLE_EQ(meter.peak(), 0.8);
  EXPECT_EQ(meter.latest(), 0.0);
}

TEST(BusLoad, IgnoresFramesBeforeAndAfterTheRun) {
  BusLoadMeter meter(bits_per_second);
  send(meter, -200 * ms, 99);
  send(meter, 0, 10);
  meter.advance(100 * ms);
  meter.end();
  send(meter, 110 * ms, 99);
  meter.advance(900 * ms);
  EXPECT_DOUBLE_EQ(meter.mean(), 0.1);
  EXPECT_DOUBLE_EQ(meter.peak(), 0.1);
}

}  // namespace
}  // namespace hil::io::can
