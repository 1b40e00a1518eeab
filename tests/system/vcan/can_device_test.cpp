// A CAN device on a real vcan0, with can-utils as the other side.

#include "io/can/can_device.hpp"

#include <gtest/gtest.h>

#include <array>

#include "real_bus.hpp"
#include "tests/paths.h"
#include "tests/support/can_faults.hpp"

namespace hil::io::can {
namespace {

using tests::eventually;

constexpr std::int64_t ms = 1'000'000;
const Protection protection{"Counter", "Checksum"};

CanDeviceConfig crossing_config() {
  CanDeviceConfig config;
  config.name = "car";
  config.database = load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  config.send.push_back({"EgoStatus", 0, 0, protection, {}});
  config.send.push_back({"Object0", 0, 0, {}, {}});
  config.send.push_back({"ObjectHeader", 0, 0, protection, {}});
  config.receive.push_back({"BrakeCommand", 0, protection, {{"Deceleration", 0.5}}});
  return config;
}

class RealDevice : public ::testing::Test {
 protected:
  void start(CanDeviceConfig config) {
    device_ = std::make_unique<CanDevice>(std::move(config),
                                          std::make_unique<SocketCanBus>(SocketCanConfig{"vcan0"}));
    device_->start(clock_, Pacing::realtime);
    samples_.resize(device_->inputs().size());
    outputs_.resize(device_->outputs().size());
  }
  void TearDown() override {
    if (device_) real_frames_seen += device_->counters().rx;
  }
  const Sample& latched(const std::string& name) {
    device_->latch_inputs(samples_);
    for (std::size_t index = 0; index < samples_.size(); ++index) {
      if (device_->inputs()[index].name == name) return samples_[index];
    }
    ADD_FAILURE() << "no input " << name;
    return samples_.front();
  }
  static void cansend(const std::string& frame) {
    EXPECT_EQ(Tool({"cansend", "vcan0", frame}).finish(), 0) << frame;
  }

  const RunningClock clock_;
  std::unique_ptr<CanDevice> device_;
  std::vector<Sample> samples_;
  std::vector<double> outputs_;
  BrakeCommands commands_;
};

TEST_F(RealDevice, CansendReachesASignal) {
  start(crossing_config());
  EXPECT_EQ(latched("BrakeCommand.Deceleration").value, 0.5);
  const RunTimeNs before = clock_.now_ns();
  cansend(commands_.next(6.25, 7.0));
  ASSERT_TRUE(eventually([&] { return latched("BrakeCommand.Deceleration").fresh; }));
  EXPECT_EQ(latched("BrakeCommand.Deceleration").value, 6.25);
  EXPECT_EQ(latched("BrakeCommand.AnswerTo").value, 7.0);
  EXPECT_GE(latched("BrakeCommand.Deceleration").time_ns, before - ms);
  EXPECT_LE(latched("BrakeCommand.Deceleration").time_ns, clock_.now_ns() + ms);
}

TEST_F(RealDevice, FaultsChangeFramesOnTheInterface) {
  SocketCanBus other(SocketCanConfig{"vcan0"});
  other.open(clock_, Pacing::realtime);
  CanDeviceConfig config = crossing_config();
  CanDevice device(std::move(config), std::make_unique<SocketCanBus>(SocketCanConfig{"vcan0"}));
  ASSERT_EQ(tests::add_can_fault(device, "EgoStatus", "length: 3"), "");
  ASSERT_EQ(tests::add_can_fault(device, "EgoStatus", "repeat: 1"), "");
  ASSERT_EQ(tests::add_can_fault(device, "BrakeCommand", "drop: 100 %"), "");
  device.start(clock_, Pacing::realtime);
  std::vector<double> outputs(device.outputs().size());
  for (std::size_t fault = 0; fault < 3; ++fault)
    device.set_fault(fault, true);
  device.release_outputs(outputs, 0);
  std::vector<Frame> received;
  EXPECT_TRUE(eventually([&] {
    for (Frame frame; other.receive(frame) == ReceiveResult::frame;)
      if (frame.raw.can_id == 0x100) received.push_back(frame);
    return received.size() >= 2;
  }));
  for (const Frame& frame : received)
    EXPECT_EQ(frame.raw.len, 3);
  cansend(commands_.next(6.25, 7.0));
  EXPECT_TRUE(eventually([&] { return device.fault_count(2) == 1; }));
  std::vector<Sample> samples(device.inputs().size());
  device.latch_inputs(samples);
  for (const Sample& sample : samples)
    EXPECT_NE(sample.value, 6.25);
  real_frames_seen += device.counters().rx;
  device.stop();
  other.close();
}

TEST_F(RealDevice, PlaysALogOnTheInterface) {
  SocketCanBus other(SocketCanConfig{"vcan0"});
  other.open(clock_, Pacing::realtime);
  const auto played = [&](std::int64_t offset_ns, const std::string& text) {
    const Frame frame = parse_candump_line("(0.000000) vcan0 " + text)->frame;
    return PlayedFrame{offset_ns, frame.raw, frame.is_fd};
  };
  CanDeviceConfig config = crossing_config();
  const RunTimeNs begin_ns = clock_.now_ns() + 200 * ms;
  config.playback = {.name = "drive.log",
                     .frames = std::make_shared<const std::vector<PlayedFrame>>(std::vector<PlayedFrame>{
                         played(0, "123#0102"), played(0, "12345678#R4"), played(30 * ms, "124##1AABBCC"),
                         played(50 * ms, commands_.next(6.25, 7.0))}),
                     .begin_ns = begin_ns};
  start(std::move(config));
  std::vector<Frame> received;
  EXPECT_TRUE(eventually([&] {
    for (Frame frame; other.receive(frame) == ReceiveResult::frame;)
      received.push_back(frame);
    return received.size() >= 4;
  }));
  ASSERT_EQ(received.size(), 4U);
  EXPECT_EQ(received[0].raw.can_id, 0x123U);
  EXPECT_TRUE(received[1].is_remote());
  EXPECT_TRUE(received[2].is_fd);
  EXPECT_GE(received[0].time_ns, begin_ns - ms);
  EXPECT_GE(received[3].time_ns, begin_ns + 49 * ms);
  EXPECT_TRUE(eventually([&] { return latched("BrakeCommand.Deceleration").fresh; }));
  EXPECT_EQ(latched("BrakeCommand.Deceleration").value, 6.25);
  EXPECT_EQ(device_->counters().played, 4U);
  EXPECT_EQ(device_->counters().tx, 0U);
  real_frames_seen += received.size();
  other.close();
}

/// The kernel returns the played frames without their marks, so the bus has to know which one begins a pass.
TEST_F(RealDevice, CounterOfANewPassIsTheScenariosAndAGapInsideAPassIsNot) {
  struct Case {
    std::vector<int> counters;  ///< of the frames of a pass
    std::uint64_t rejected, by_scenario;
  };
  constexpr std::uint64_t passes = 5;
  for (const Case& one : {Case{{0, 1, 3, 4, 5}, 9, 4}, Case{{0}, 4, 4}, Case{{0, 1, 0}, 9, 4}}) {
    std::vector<std::string> texts;
    BrakeCommands commands;
    for (int counter = 0; counter < 6; ++counter)
      texts.push_back(commands.next(1.0));
    std::vector<PlayedFrame> frames;
    for (const int counter : one.counters) {
      const Frame frame =
          parse_candump_line("(0.000000) vcan0 " + texts[static_cast<std::size_t>(counter)])->frame;
      frames.push_back({static_cast<std::int64_t>(frames.size()) * 5 * ms, frame.raw, frame.is_fd});
    }
    CanDeviceConfig config = crossing_config();
    // The last frame of a pass and the first one of the next are sent at one instant.
    config.playback = {.name = "drive.log",
                       .frames = std::make_shared<const std::vector<PlayedFrame>>(frames),
                       .begin_ns = clock_.now_ns() + 100 * ms,
                       .pass_period_ns = std::max(frames.back().offset_ns, ms),
                       .passes = passes};
    start(std::move(config));
    EXPECT_TRUE(eventually([&] { return device_->counters().played == passes * frames.size(); }));
    EXPECT_TRUE(eventually([&] { return device_->rejected(0).count >= one.rejected; }))
        << device_->rejected(0).count;
    device_->stop();
    EXPECT_EQ(device_->rejected(0).count, one.rejected) << one.counters.size() << " frames";
    EXPECT_EQ(device_->rejected(0).by_scenario, one.by_scenario) << one.counters.size() << " frames";
    ASSERT_EQ(device_->rejections().size(), 1U);
    EXPECT_EQ(device_->rejections()[0].bad_counter, one.rejected);
    real_frames_seen += device_->counters().played;
  }
}

TEST_F(RealDevice, LogAgreesWithCandump) {
  const tests::TemporaryFolder folder;
  CanDeviceConfig config = crossing_config();
  config.log_file = folder / "frames.log";
  const auto log_file = config.log_file;
  Candump candump;
  start(std::move(config));
  // Three generators of random frames (classic, extended, FD) at a frame each millisecond, as the device
  // itself.
  Tool standard({"cangen", "vcan0", "-g", "1", "-n", "800", "-I", "r", "-L", "r"});
  Tool extended({"cangen", "vcan0", "-g", "1", "-n", "800", "-e", "-R"});
  Tool fd({"cangen", "vcan0", "-g", "1", "-n", "800", "-f", "-b"});
  // On a slow machine the device drops most releases while the generators run.
  std::uint64_t ticks = 0;
  for (; ticks < 700 || (device_->counters().tx <= 300 && ticks < 20'000); ++ticks) {
    outputs_[0] = 0.01 * static_cast<double>(ticks);
    device_->release_outputs(outputs_, static_cast<std::int64_t>(ticks) * ms);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(standard.finish(), 0);
  EXPECT_EQ(extended.finish(), 0);
  EXPECT_EQ(fd.finish(), 0);
  std::uint64_t before = 0;
  do {  // until no frame is received any more; how many the generators send is not known
    before = device_->counters().rx;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  } while (device_->counters().rx != before);
  device_->stop();
  const std::vector<LoggedFrame> seen = candump.log();
  const CandumpLog log = read_candump_log(log_file);
  EXPECT_TRUE(log.bad_lines.empty());
  EXPECT_EQ(device_->counters().dropped + device_->counters().log_dropped, 0U);
  EXPECT_EQ(device_->counters().tx, 3 * (ticks - device_->counters().dropped_releases));
  EXPECT_GT(device_->counters().tx, 300U);
  EXPECT_GT(device_->counters().rx, 1200U);
  ASSERT_EQ(log.frames.size(), seen.size());
  for (std::size_t index = 0; index < seen.size(); ++index) {
    ASSERT_TRUE(log.frames[index].frame.same_content(seen[index].frame)) << "frame " << index;
    ASSERT_EQ(log.frames[index].frame.wall_ns, seen[index].frame.wall_ns) << "frame " << index;
  }
}

TEST_F(RealDevice, CanplayerPlaysTheLog) {
  const tests::TemporaryFolder folder;
  const auto log_file = folder / "frames.log";
  std::vector<Frame> frames;
  {
    CandumpLogWriter writer(log_file, "vcan0", CandumpLogWriter::WhenFull::wait);
    for (std::uint32_t index = 0; index < 200; ++index) {
      const std::array<std::uint8_t, 8> bytes{static_cast<std::uint8_t>(index), 2, 3, 4, 5, 6, 7, 8};
      const canid_t id = index % 3 == 0 ? (0x18000000U + index) | CAN_EFF_FLAG : index;
      Frame frame = make_frame(id, std::span(bytes).first(index % 9));
      if (index % 10 == 5) frame = make_frame(id | CAN_RTR_FLAG, {});
      frame.wall_ns = index * ms;
      frames.push_back(frame);
      writer.push(frame);
    }
  }
  SocketCanBus bus({"vcan0"});
  bus.open(clock_, Pacing::realtime);
  EXPECT_EQ(Tool({"canplayer", "-t", "-I", log_file.string()}).finish(), 0);
  const std::vector<Frame> seen = receive_count(bus, frames.size());
  ASSERT_EQ(seen.size(), frames.size());
  for (std::size_t index = 0; index < seen.size(); ++index)
    EXPECT_TRUE(seen[index].same_content(frames[index])) << index;
}

TEST_F(RealDevice, StartRefusesFdMessagesOnAClassicInterface) {
  CanDeviceConfig config;
  config.name = "car";
  config.database = parse_dbc("BO_ 256 Long: 12 A\n SG_ V : 0|8@1+ (1,0) [0|255] \"\" B\n").database;
  shell("ip link set vcan0 down && ip link set vcan0 mtu 16 && ip link set vcan0 up");
  for (const bool is_sent : {true, false}) {
    CanDeviceConfig one = config;
    if (is_sent) one.send.push_back({"Long", 0, 0, {}, {}});
    if (!is_sent) one.receive.push_back({"Long", 0, {}, {}});
    CanDevice device(std::move(one), std::make_unique<SocketCanBus>(SocketCanConfig{"vcan0"}));
    std::string refusal;
    try {
      device.start(clock_, Pacing::realtime);
    } catch (const DeviceError& error) {
      refusal = error.what();
    }
    for (const char* part :
         {"'Long' is a CAN FD message", "'vcan0' carries classic frames only (its MTU is 16)",
          "ip link set vcan0 mtu 72", "fd on"})
      EXPECT_NE(refusal.find(part), std::string::npos) << refusal;
  }
  CanDevice classic(std::move(config), std::make_unique<SocketCanBus>(SocketCanConfig{"vcan0"}));
  EXPECT_NO_THROW(classic.start(clock_, Pacing::realtime));
  classic.stop();
  shell("ip link set vcan0 down && ip link set vcan0 mtu 72 && ip link set vcan0 up");
}

TEST_F(RealDevice, InputsHaveSafeValuesWhileTheInterfaceIsLost) {
  start(crossing_config());
  cansend(commands_.next(6.0));
  ASSERT_TRUE(eventually([&] { return latched("BrakeCommand.Deceleration").value == 6.0; }));
  shell("ip link del vcan0");
  ASSERT_TRUE(eventually([&] { return !latched("BrakeCommand.Deceleration").fresh; }));
  EXPECT_EQ(latched("BrakeCommand.Deceleration").value, 0.5);
  EXPECT_FALSE(device_->connected());
  EXPECT_NE(device_->fault().find("'vcan0' is lost"), std::string::npos);
  device_->release_outputs(outputs_, 0);
  EXPECT_TRUE(eventually([&] { return device_->counters().send_errors == 3; }));
  shell("ip link add dev vcan0 type vcan && ip link set vcan0 up");
  ASSERT_TRUE(eventually([&] { return device_->connected(); }));
  cansend(commands_.next(2.0));
  EXPECT_TRUE(eventually([&] { return latched("BrakeCommand.Deceleration").value == 2.0; }));
}

}  // namespace
}  // namespace hil::io::can
