// Frames of a log that a CAN device sends.

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

#include "driven_bus.hpp"
#include "io/can/log_playback.hpp"
#include "io/virtual/hub.hpp"
#include "io/virtual/station.hpp"
#include "tests/support/can_faults.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::can {
namespace {

PlayedFrame played(std::int64_t offset_ns, canid_t id, std::uint8_t byte) {
  return {.offset_ns = offset_ns, .raw = make_frame(id, {{byte}}).raw};
}

PlaybackConfig log_of(std::vector<PlayedFrame> frames, RunTimeNs begin_ns = 0, std::uint64_t passes = 1,
                      std::int64_t pass_period_ns = 0) {
  return {.name = "drive.log",
          .frames = std::make_shared<const std::vector<PlayedFrame>>(std::move(frames)),
          .begin_ns = begin_ns,
          .pass_period_ns = pass_period_ns,
          .passes = passes};
}

/// The device of a bus, in lock-step with a period of 10 ms; its log has frames of a message that it
/// receives, and of another one.
class PlayingDevice : public ::testing::Test {
 protected:
  struct FaultEntry {
    std::string message, entry;
  };
  void open(PlaybackConfig playback, std::unique_ptr<CanTransport> bus,
            const std::vector<FaultEntry>& faults = {}) {
    CanDeviceConfig config = crossing_config();
    config.send = {{"EgoStatus", 20 * ms, 0, protection, {}}};
    config.receive = {{"BrakeCommand", 0, {}, {}}};
    config.playback = std::move(playback);
    device_ = std::make_unique<CanDevice>(std::move(config), std::move(bus));
    for (const FaultEntry& fault : faults)
      EXPECT_EQ(tests::add_can_fault(*device_, fault.message, fault.entry), "");
    device_->start(clock_, Pacing::lockstep);
  }
  void tick(std::int64_t now_ms) {
    clock_.set(now_ms * ms);
    device_->release_outputs(std::vector<double>(device_->outputs().size(), 0.0), clock_.now_ns());
    EXPECT_TRUE(device_->exchange(clock_.now_ns()));
  }
  std::vector<std::string> events() const {
    std::vector<std::string> texts;
    for (const DeviceEvent& event : device_->events_since(0))
      texts.push_back(std::to_string(event.time_ns / ms) + ": " + event.text);
    return texts;
  }

  SetClock clock_;
  std::unique_ptr<CanDevice> device_;
};

PlayedFrame brake(std::int64_t offset_ns, double deceleration) {
  const Dbc database = load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  const DbcMessage& message = *database.find_message("BrakeCommand");
  MessageEncoder encoder(message, {});
  std::vector<double> values(message.signals.size(), 0.0);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (message.signals[i].name == "Deceleration") values[i] = deceleration;
  MessageEncoder::Tally tally;
  return {.offset_ns = offset_ns, .raw = encoder.build(values, tally).raw};
}

TEST_F(PlayingDevice, ReceivesWhatItPlaysInLockStep) {
  open(log_of({brake(0, 2.0), played(3 * ms, 0x555, 1), brake(12 * ms, 4.0), brake(28 * ms, 5.0)}, 10 * ms),
       std::make_unique<virtual_bus::Hub>(virtual_bus::HubConfig{.name = "car", .path = {}, .faults = {}}));
  std::vector<Sample> samples(device_->inputs().size());
  std::size_t input = 0;
  while (device_->inputs()[input].name != "BrakeCommand.Deceleration")
    ++input;
  std::string seen;
  for (int now_ms = 0; now_ms <= 40; now_ms += 10) {
    tick(now_ms);
    device_->latch_inputs(samples);
    seen += samples[input].fresh ? std::to_string(static_cast<int>(samples[input].value)) + "@" +
                                       std::to_string(samples[input].time_ns / ms) + " "
                                 : "- ";
  }
  EXPECT_EQ(seen, "- 2@10 2@10 4@30 5@40 ") << "each in the first exchange that is not before it";
  const CanCounters counters = device_->counters();
  EXPECT_EQ(counters.played, 4U);
  EXPECT_EQ(counters.tx, 3U);
  EXPECT_EQ(counters.rx, 0U);
  EXPECT_EQ(counters.unknown_id, 1U);
  EXPECT_EQ(events(), (std::vector<std::string>{"10: log drive.log begins on CAN bus car",
                                                "40: log drive.log ends on CAN bus car"}));
}

TEST_F(PlayingDevice, FaultsOfReceivedMessagesActOnPlayedFrames) {
  CanDeviceConfig config = crossing_config();
  config.send.clear();
  config.receive = {{"BrakeCommand", 0, {}, {}}};
  config.playback = log_of({brake(0, 2.0), brake(30 * ms, 4.0)});
  device_ = std::make_unique<CanDevice>(
      std::move(config),
      std::make_unique<virtual_bus::Hub>(virtual_bus::HubConfig{.name = "car", .path = {}, .faults = {}}));
  ASSERT_EQ(tests::add_can_fault(*device_, "BrakeCommand", "delay: 20 ms"), "");
  device_->set_fault(0, true);
  device_->start(clock_, Pacing::lockstep);
  std::vector<Sample> samples(device_->inputs().size());
  for (const int now_ms : {0, 10}) {
    tick(now_ms);
    device_->latch_inputs(samples);
    EXPECT_FALSE(samples[0].fresh) << now_ms;
  }
  tick(20);
  device_->latch_inputs(samples);
  EXPECT_TRUE(samples[0].fresh);
  EXPECT_EQ(device_->fault_count(0), 1U);
  EXPECT_EQ(device_->counters().tx, 0U) << "a delayed frame is not sent again";
}

TEST_F(PlayingDevice, FaultsOfAnIdentifierActOnPlayedFrames) {
  const auto sent_with = [&](const std::string& entry) {
    auto owned = std::make_unique<DrivenBus>();
    DrivenBus& bus = *owned;
    open(log_of({played(0, 0x555, 1), played(10 * ms, 0x556, 2), played(20 * ms, 0x555, 3)}),
         std::move(owned), {{"0x555", entry}});
    device_->set_fault(0, true);
    for (const int now_ms : {0, 10, 20, 30})
      tick(now_ms);
    std::string sent;
    for (const Frame& frame : bus.sent) {
      if (frame.raw.can_id == 0x555 || frame.raw.can_id == 0x556)
        sent += std::to_string(frame.raw.data[0]) + (frame.raw.len == 1 ? "" : "*") + " ";
    }
    return sent;
  };
  EXPECT_EQ(sent_with("drop: 100 %"), "2 ");
  EXPECT_EQ(device_->fault_effects(0), 2U);
  EXPECT_EQ(device_->counters().played, 1U);
  EXPECT_TRUE(device_->playback()->last_ns) << "dropped frames have been played";
  EXPECT_EQ(sent_with("repeat: 1"), "1 1 2 3 3 ");
  EXPECT_EQ(sent_with("delay: 10 ms"), "1 2 3 ");
  EXPECT_EQ(device_->counters().played, 3U);
  EXPECT_EQ(sent_with("flip_bits: [1]"), "3 2 1 ");
  EXPECT_EQ(sent_with("length: 2"), "1* 2 3* ");
  EXPECT_EQ(device_->fault_count(0), 2U);
}

TEST_F(PlayingDevice, FaultsOfAnIdentifierAreThoseOfItsMessageOrOfPlayedFrames) {
  open(log_of({played(0, 0x555, 1), played(10 * ms, 0x556, 2)}), std::make_unique<DrivenBus>());
  const auto problem = [&](const std::string& message, const std::string& entry) {
    return tests::can_fault_problem(*device_, message, entry);
  };
  EXPECT_EQ(problem("0x555", "drop: 100 %"), "");
  const std::string not_here =
      "the bus neither sends nor receives nor plays this message; it sends or receives EgoStatus, "
      "BrakeCommand";
  EXPECT_EQ(problem("0x00000555", "drop: 100 %"), not_here);
  EXPECT_EQ(problem("0x557", "drop: 100 %"), not_here);
  EXPECT_EQ(problem("0x", "drop: 100 %"), not_here);
  EXPECT_EQ(problem("0x8ff", "drop: 100 %"), not_here);
  EXPECT_EQ(problem("0x555", "length: 1"), "all its frames already have a length of 1; give another");
  EXPECT_EQ(problem("0x555", "length: 9"), "no classic CAN frame has 9 bytes");
  EXPECT_EQ(problem("0x555", "flip_bits: [8]"),
            "bit 8 is not in its longest frame, which has the bits 0 to 7");
  for (const char* const entry : {"stuck: last", "wrong: counter", "wrong: checksum"})
    EXPECT_EQ(problem("0x555", entry),
              "only a message of the DBC file can be stuck or have a wrong counter or checksum");
  const MessageLayout layout(*crossing_config().database.find_message("EgoStatus"), {}, Use::send);
  char identifier[16];
  std::snprintf(identifier, sizeof identifier, "0x%x", layout.can_id());
  EXPECT_EQ(problem(identifier, "stuck: last"), "") << identifier << " is EgoStatus, which the device sends";
}

TEST_F(PlayingDevice, CountsFramesThatTheBusDoesNotTake) {
  auto owned = std::make_unique<DrivenBus>();
  DrivenBus& bus = *owned;
  open(log_of({played(0, 0x555, 1), played(10 * ms, 0x555, 2), played(20 * ms, 0x555, 3)}), std::move(owned));
  bus.error = EINVAL;
  tick(0);
  bus.error = 0;
  bus.full = true;
  tick(10);
  tick(20);
  bus.full = false;
  tick(30);
  std::string sent;
  for (const Frame& frame : bus.sent)
    if (frame.raw.can_id == 0x555) sent += std::to_string(frame.raw.data[0]);
  EXPECT_EQ(sent, "23");
  EXPECT_EQ(device_->playback()->dropped, 1U);
  EXPECT_EQ(device_->playback()->sent, 2U);
  EXPECT_EQ(device_->counters().send_errors, 1U) << "of EgoStatus; the playback counts the frame of the log";
  EXPECT_NE(device_->send_fault().find("could not be sent on CAN bus 'car'"), std::string::npos);
}

TEST_F(PlayingDevice, EndsWithTheSafeValues) {
  auto owned = std::make_unique<DrivenBus>();
  DrivenBus& bus = *owned;
  open(log_of({played(0, 0x555, 1)}, 0, 0, 10 * ms), std::move(owned));
  tick(0);
  tick(10);
  device_->enter_safe_state();
  tick(20);
  tick(30);
  EXPECT_EQ(std::ranges::count(bus.sent, canid_t{0x555}, [](const Frame& frame) { return frame.raw.can_id; }),
            3);
}

TEST(PlayingInRealTime, IsSeenByOtherStationsAtItsTimes) {
  auto hub =
      std::make_unique<virtual_bus::Hub>(virtual_bus::HubConfig{.name = "car", .path = {}, .faults = {}});
  virtual_bus::Station outside({hub->address(), "outside"});
  CanDeviceConfig config = crossing_config();
  config.send.clear();
  config.playback = log_of({played(0, 0x555, 1), played(60 * ms, 0x555, 2)}, 300 * ms);
  const RunningClock clock;
  CanDevice device(std::move(config), std::move(hub));
  device.start(clock, Pacing::realtime);
  outside.open(clock, Pacing::realtime);
  std::vector<Frame> seen;
  EXPECT_TRUE(tests::eventually([&] {
    Frame frame;
    while (outside.receive(frame) == ReceiveResult::frame)
      seen.push_back(frame);
    return seen.size() == 2;
  }));
  device.stop();
  ASSERT_EQ(seen.size(), 2U);
  const PlaybackState state = *device.playback();
  EXPECT_GE(*state.first_ns, 300 * ms);
  EXPECT_GE(*state.last_ns, 360 * ms);
  EXPECT_EQ(state.sent, 2U);
}

}  // namespace
}  // namespace hil::io::can
