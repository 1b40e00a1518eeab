#include "io/can/send_order.hpp"

#include <gtest/gtest.h>

namespace hil::io::can {
namespace {

TEST(SendOrder, EchoedFramesRaiseTheEarliestTime) {
  SendOrder order;
  EXPECT_EQ(order.earliest_ns(), std::numeric_limits<RunTimeNs>::min());
  order.sent(0x100, 10);
  order.sent(0x100, 20);
  order.sent(0x200, 30);
  order.received_back(0x300);
  EXPECT_EQ(order.earliest_ns(), std::numeric_limits<RunTimeNs>::min()) << "another program's frame";
  order.received_back(0x100);
  EXPECT_EQ(order.earliest_ns(), 10);
  order.received_back(0x200);
  EXPECT_EQ(order.earliest_ns(), 30) << "the second 0x100 was lost on the way";
  order.received_back(0x100);
  EXPECT_EQ(order.earliest_ns(), 30);
}

TEST(SendOrder, ForgetsTheOldestFramesWithoutAnEcho) {
  SendOrder order;
  for (RunTimeNs time = 1; time <= 1'000; ++time)
    order.sent(static_cast<canid_t>(time), time);
  order.received_back(744);
  EXPECT_EQ(order.earliest_ns(), std::numeric_limits<RunTimeNs>::min());
  order.received_back(745);
  EXPECT_EQ(order.earliest_ns(), 745);
  order.received_back(1'000);
  EXPECT_EQ(order.earliest_ns(), 1'000);
}

}  // namespace
}  // namespace hil::io::can
