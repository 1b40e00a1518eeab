// The receive times and time-outs of a CAN device.

#include <memory>
#include <vector>

#include "driven_device.hpp"

namespace hil::io::can {
namespace {

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
