// The bus load before a run and in it.

#include <gtest/gtest.h>

#include <vector>

#include "io/can/can_counters.hpp"

namespace hil::io::can {
namespace {

constexpr RunTimeNs ms = 1'000'000;

/// 111 bits on the wire.
Frame frame_at(RunTimeNs time_ns) {
  Frame frame = make_frame(0x100, std::vector<std::uint8_t>(8));
  frame.time_ns = time_ns;
  return frame;
}

TEST(BusLoad, CountsTheLastWholeTenthOfASecondBeforeTheRunToo) {
  BusLoadMeter meter(11'100.0);  // ten such frames in a tenth of a second
  for (const RunTimeNs begin_ns : {-1000 * ms, 0 * ms, 1000 * ms}) {
    for (int frame = 0; frame < 5; ++frame)
      meter.add(frame_at(begin_ns + (10 + frame) * ms));
    meter.advance(begin_ns + 99 * ms);
    EXPECT_EQ(meter.load(), 0.0);
    meter.advance(begin_ns + 100 * ms);
    EXPECT_DOUBLE_EQ(meter.load(), 0.5) << "from " << begin_ns;
    meter.advance(begin_ns + 200 * ms);
    EXPECT_EQ(meter.load(), 0.0);
  }
}

TEST(BusLoad, WhatCameBeforeTheRunIsNoneOfItsFirstWindow) {
  BusLoadMeter meter(11'100.0);
  for (RunTimeNs now_ns = -10'000'000 * ms; now_ns < -9'990'000 * ms; now_ns += 10 * ms)
    meter.add(frame_at(now_ns));
  meter.add(frame_at(-1 * ms));  // run time has leapt
  meter.add(frame_at(5 * ms));
  meter.advance(100 * ms);
  EXPECT_DOUBLE_EQ(meter.load(), 0.1);
}

}  // namespace
}  // namespace hil::io::can
