// A CAN device on a bus that the test drives: refused frames, bus-off, receive times, time-outs.

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <cerrno>
#include <memory>
#include <vector>

#include "driven_bus.hpp"
#include "tests/support/simulation/run_clock.hpp"

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

/// One message sent every 10 ms, one received with a time-out of 200 ms, over a bus that the test drives.
class DrivenDevice : public ::testing::Test {
 protected:
  explicit DrivenDevice(bool may_be_lost = false) {
    CanDeviceConfig config = crossing_config();
    config.send = {{"EgoStatus", 10 * ms, 0, protection, {}}};
    config.may_be_lost = may_be_lost;
    for (ReceivedMessageConfig& received : config.receive)
      received.timeout_ns = 200 * ms;
    auto owned = std::make_unique<DrivenBus>();
    bus_ = owned.get();
    device_ = std::make_unique<CanDevice>(std::move(config), std::move(owned));
    device_->start(clock_, Pacing::lockstep);
  }
  void ticks(RunTimeNs from_ms, RunTimeNs to_ms) {
    const std::vector<double> outputs(device_->outputs().size(), 0.0);
    for (RunTimeNs now = from_ms * ms; now < to_ms * ms; now += 10 * ms) {
      clock_.set(now);
      device_->release_outputs(outputs, now);
      EXPECT_TRUE(device_->exchange(now));
    }
  }
  static Frame error_frame(canid_t classes) {
    Frame frame;
    frame.raw.can_id = CAN_ERR_FLAG | classes;
    frame.raw.len = CAN_ERR_DLC;
    return frame;
  }

  SetClock clock_;
  DrivenBus* bus_ = nullptr;
  std::unique_ptr<CanDevice> device_;
};

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

TEST_F(DrivenDevice, ReceiveTimeFollowsTheSendTimeOfEarlierFrames) {
  const Dbc database = load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  const DbcMessage& message = *database.find_message("BrakeCommand");
  MessageEncoder encoder(message, protection);
  MessageEncoder::Tally tally;
  const auto reply_at = [&](RunTimeNs time_ns) {
    Frame reply = encoder.build(std::vector<double>(message.signals.size(), 1.0), tally);
    encoder.confirm_sent();
    reply.direction = Direction::rx;
    reply.time_ns = time_ns;
    return reply;
  };
  const auto received_at = [&] {
    std::vector<Sample> samples(device_->inputs().size());
    device_->latch_inputs(samples);
    return samples[device_->input_groups().front().first].time_ns;
  };
  ticks(0, 10);
  Frame echo = bus_->sent.back();
  echo.direction = Direction::tx;
  bus_->arriving = {reply_at(-1 * ms)};
  ticks(10, 20);
  EXPECT_EQ(received_at(), -1 * ms) << "possibly received before the sent frame";
  bus_->arriving = {echo, echo, reply_at(8 * ms)};
  ticks(20, 30);
  EXPECT_EQ(received_at(), 10 * ms) << "after the frame that was sent at 10 ms";
  bus_->arriving = {reply_at(12 * ms)};
  ticks(30, 40);
  EXPECT_EQ(received_at(), 12 * ms);
}

TEST(CanLossTimeout, IsTheShortestTimeoutOfAReceivedMessage) {
  for (const bool shortest_first : {true, false}) {
    CanDeviceConfig config = crossing_config();
    config.send = {{"EgoStatus", 10 * ms, 0, protection, {}}};
    config.receive = {{"BrakeCommand", (shortest_first ? 200 : 300) * ms, protection, {}},
                      {"Object0", (shortest_first ? 300 : 200) * ms, {}, {}}};
    EXPECT_EQ(CanDevice(std::move(config), std::make_unique<DrivenBus>()).loss_timeout_ns(), 200 * ms);
  }
}

TEST_F(DrivenDevice, InputGroupIsAMessageWithItsTimeout) {
  ASSERT_FALSE(device_->input_groups().empty());
  const InputGroup& group = device_->input_groups().front();
  EXPECT_EQ(group.name, "BrakeCommand");
  EXPECT_TRUE(device_->inputs()[group.first].name.starts_with("BrakeCommand."));
  EXPECT_EQ(group.timeout_ns, 200 * ms);
}

}  // namespace
}  // namespace hil::io::can
