// A CAN device whose bus refuses frames or is bus-off.

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <cerrno>
#include <memory>
#include <vector>

#include "driven_device.hpp"

namespace hil::io::can {
namespace {

TEST(CanSendFaults, FullQueueIsRetriedOnceAtTheNextTick) {
  CanDeviceConfig config = crossing_config();
  config.send = {{"EgoStatus", 10 * ms, 0, protection, {}}};
  auto owned = std::make_unique<DrivenBus>();
  DrivenBus& bus = *owned;
  SetClock clock;
  CanDevice device(std::move(config), std::move(owned));
  device.start(clock, Pacing::lockstep);
  const std::vector<double> outputs(device.outputs().size(), 0.0);
  const auto tick = [&](RunTimeNs now) {
    device.release_outputs(outputs, now);
    EXPECT_TRUE(device.exchange(now));
  };
  bus.full = true;
  tick(0);
  EXPECT_EQ(bus.tries, 1);
  tick(1 * ms);
  EXPECT_EQ(bus.tries, 2) << "one retry";
  tick(2 * ms);
  EXPECT_EQ(bus.tries, 2) << "no second retry";
  tick(10 * ms);
  EXPECT_EQ(bus.tries, 3);
  bus.full = false;
  tick(11 * ms);
  tick(20 * ms);
  ASSERT_EQ(bus.sent.size(), 2U);
  EXPECT_EQ(bus.sent[0].raw.data[4] & 0xF, 0) << "the counter counts frames that were sent";
  EXPECT_EQ(bus.sent[1].raw.data[4] & 0xF, 1);
  EXPECT_EQ(device.counters().no_buffer, 3U);
  EXPECT_EQ(device.counters().tx, 2U);
}

class DrivenDeviceThatMayBeLost : public DrivenDevice {
 protected:
  DrivenDeviceThatMayBeLost() : DrivenDevice(true) {}
};

TEST_F(DrivenDevice, ReportsARefusedFrameWithItsBusAndCause) {
  ticks(0, 100);
  EXPECT_EQ(device_->send_fault(), "");
  bus_->error = EINVAL;
  ticks(100, 200);
  EXPECT_EQ(device_->send_fault(),
            "message EgoStatus could not be sent on CAN bus 'car' (full): Invalid argument");
  EXPECT_EQ(device_->counters().send_errors, 10U);
  bus_->error = ENETDOWN;
  ticks(200, 300);
  EXPECT_NE(device_->send_fault().find("Invalid argument"), std::string::npos) << "the first fault stays";
}

TEST_F(DrivenDeviceThatMayBeLost, FramesLostWithTheInterfaceAreNoFault) {
  bus_->error = ENETDOWN;
  ticks(0, 100);
  EXPECT_EQ(device_->send_fault(), "");
  EXPECT_EQ(device_->counters().send_errors, 10U);
  bus_->error = EINVAL;
  ticks(100, 200);
  EXPECT_NE(device_->send_fault(), "");
}

TEST_F(DrivenDevice, QueueThatStaysFullIsAFault) {
  bus_->full = true;
  ticks(0, 190);
  bus_->full = false;
  ticks(190, 400);
  EXPECT_EQ(device_->send_fault(), "");
  bus_->full = true;
  ticks(400, 700);
  EXPECT_NE(device_->send_fault().find("took no frame for more than 200 ms"), std::string::npos)
      << device_->send_fault();
}

Frame error_frame(canid_t classes) {
  Frame frame;
  frame.raw.can_id = CAN_ERR_FLAG | classes;
  frame.raw.len = CAN_ERR_DLC;
  return frame;
}

TEST_F(DrivenDevice, BusOffDisconnectsUntilTheRestart) {
  ticks(0, 10);
  EXPECT_TRUE(device_->connected());
  bus_->arriving = {error_frame(CAN_ERR_BUSOFF)};
  ticks(10, 20);
  EXPECT_FALSE(device_->connected());
  EXPECT_NE(device_->fault().find("bus-off"), std::string::npos) << device_->fault();
  bus_->arriving = {error_frame(CAN_ERR_CRTL)};
  ticks(20, 30);
  EXPECT_FALSE(device_->connected()) << "no restart";
  bus_->arriving = {error_frame(CAN_ERR_RESTARTED)};
  ticks(30, 40);
  EXPECT_TRUE(device_->connected());
  EXPECT_EQ(device_->fault(), "");
  EXPECT_EQ(device_->counters().errors, 3U);
}

}  // namespace
}  // namespace hil::io::can
