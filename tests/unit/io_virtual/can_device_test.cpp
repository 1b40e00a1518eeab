// A CAN device on a virtual bus, with hil-aeb-controller as the other side: in lock-step and in real time.

#include "io/can/can_device.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "driven_bus.hpp"
#include "io/virtual/hub.hpp"
#include "io/virtual/process.hpp"
#include "io/virtual/station.hpp"
#include "tests/paths.h"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::io::can {
namespace {

using tests::TemporaryFolder;

std::size_t channel(std::span<const ChannelInfo> channels, const std::string& name) {
  for (std::size_t index = 0; index < channels.size(); ++index) {
    if (channels[index].name == name) return index;
  }
  ADD_FAILURE() << "no channel " << name;
  return 0;
}

virtual_bus::HubConfig hub_config(std::size_t expected_stations) {
  return {.name = "car", .path = {}, .faults = {}, .expected_stations = expected_stations};
}

process::ChildConfig controller_config(const std::string& address, const TemporaryFolder& folder) {
  const std::string program = HIL_BINARY_DIR "/bin/hil-aeb-controller";
  const std::string database = HIL_SOURCE_DIR "/configs/crossing/crossing.dbc";
  return {.name = "dut",
          .command = {program, "--bus", address, "--database", database},
          .search_folders = {},
          .working_folder = {},
          .output_file = folder / "controller.txt"};
}

void set_danger(CanDevice& device, std::vector<double>& outputs, double time_s) {
  const auto set = [&](const char* name, double value) { outputs[channel(device.outputs(), name)] = value; };
  set("EgoStatus.Speed", 14.0);
  set("Object0.Valid", 1.0);
  set("Object0.PosX", 60.0 - 14.0 * time_s);
  set("Object0.PosY", -60.0 + 14.0 * time_s);
  set("Object0.VelX", 0.0);
  set("Object0.VelY", 14.0);
  set("Object0.Length", 4.5);
  set("ObjectHeader.ObjectCount", 1.0);
}

TEST(CanDevice, ChannelsFollowTheDatabase) {
  CanDevice device(crossing_config(), std::make_unique<virtual_bus::Hub>(hub_config(0)));
  EXPECT_EQ(device.inputs()[0].name, "EgoStatus.Counter");
  EXPECT_EQ(device.inputs()[1].name, "ObjectHeader.Counter");
  const auto& deceleration = device.inputs()[channel(device.inputs(), "BrakeCommand.Deceleration")];
  EXPECT_EQ(deceleration.unit, "m/s2");
  EXPECT_EQ(deceleration.safe_value, 1.5);
  EXPECT_EQ(deceleration.maximum, 20.0);
  for (const ChannelInfo& output : device.outputs()) {
    EXPECT_EQ(output.name.find("Counter"), std::string::npos);
    EXPECT_EQ(output.name.find("Checksum"), std::string::npos);
  }
  EXPECT_EQ(device.outputs().size(), 2U + 7U + 2U);
  std::vector<Sample> samples(device.inputs().size());
  device.latch_inputs(samples);
  EXPECT_FALSE(samples[2].fresh);
  EXPECT_EQ(samples[channel(device.inputs(), "BrakeCommand.Deceleration")].value, 1.5);
}

TEST(CanDevice, ReportsEveryMistakeInItsConfiguration) {
  CanDeviceConfig config = crossing_config();
  config.send.push_back({"Nothing", -1, 0, {}, {}});
  config.receive.push_back({"EgoStatus", -1, {"Speed", ""}, {{"Sped", 1.0}, {"Speed", std::nan("")}}});
  config.bits_per_second = 0.0;
  EXPECT_EQ(configuration_problems(config).size(), 8U);
  EXPECT_THROW(CanDevice(std::move(config), std::make_unique<virtual_bus::Hub>(hub_config(0))), DeviceError);
}

/// Runs 2 s in lock-step with the controller in its own process, checks its replies, and returns the log.
std::string lockstep_log() {
  const TemporaryFolder folder;
  auto hub = std::make_unique<virtual_bus::Hub>(hub_config(1));
  process::Child controller(controller_config(hub->address(), folder));
  CanDeviceConfig config = crossing_config();
  config.log_file = folder / "frames.log";
  const auto log_file = config.log_file;
  SetClock clock;
  {
    CanDevice device(std::move(config), std::move(hub));
    device.start(clock, Pacing::lockstep);
    std::vector<double> outputs(device.outputs().size(), 0.0);
    std::vector<Sample> samples(device.inputs().size());
    const std::size_t request = channel(device.inputs(), "ObjectHeader.Counter");
    const std::size_t reply = channel(device.inputs(), "BrakeCommand.AnswerTo");
    const std::size_t deceleration = channel(device.inputs(), "BrakeCommand.Deceleration");
    double strongest = 0.0;
    for (int tick = 0; tick < 200; ++tick) {
      const RunTimeNs now = tick * 10 * ms;
      clock.set(now);
      set_danger(device, outputs, static_cast<double>(now) * 1e-9);
      device.release_outputs(outputs, now);
      EXPECT_TRUE(device.exchange(now)) << device.fault();
      device.latch_inputs(samples);
      EXPECT_TRUE(samples[request].fresh);
      EXPECT_EQ(samples[request].value, tick / 10);
      EXPECT_EQ(samples[request].time_ns, tick / 10 * 100 * ms);
      EXPECT_EQ(samples[reply].value, samples[request].value) << "a reply in the same instant";
      EXPECT_EQ(samples[reply].time_ns, samples[request].time_ns);
      strongest = std::max(strongest, samples[deceleration].value);
    }
    EXPECT_GT(strongest, 3.0) << "the controller brakes";
    EXPECT_LE(strongest, 9.0);
    clock.set(2300 * ms);
    device.latch_inputs(samples);
    EXPECT_FALSE(samples[deceleration].fresh) << "older than its time-out";
    EXPECT_EQ(samples[deceleration].value, 1.5);
    device.stop();
    EXPECT_EQ(device.counters().rx, 20U);
    EXPECT_EQ(device.counters().tx, 200U + 20U + 20U);
    EXPECT_EQ(device.counters().log_dropped, 0U);
    EXPECT_GT(device.counters().bus_load_mean, 0.0);
    EXPECT_GE(device.counters().bus_load_peak, device.counters().bus_load_mean);
  }
  EXPECT_TRUE(controller.wait_for_exit(5'000 * ms)) << "the controller ends when its bus closes";
  EXPECT_TRUE(controller.exit().success()) << describe(controller.exit());
  return tests::content_of(log_file);
}

TEST(CanDevice, LockstepRunsWithAnotherProcessAreIdentical) {
  const std::string first = lockstep_log();
  EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 260);
  EXPECT_EQ(lockstep_log(), first);
}

TEST(CanDevice, ReportsAControllerThatEndsInLockstep) {
  const TemporaryFolder folder;
  auto hub = std::make_unique<virtual_bus::Hub>(hub_config(1));
  process::Child controller(controller_config(hub->address(), folder));
  SetClock clock;
  CanDevice device(crossing_config(), std::move(hub));
  device.start(clock, Pacing::lockstep);
  ASSERT_TRUE(device.exchange(0));
  controller.stop(1'000 * ms);
  EXPECT_FALSE(device.exchange(ms));
  EXPECT_NE(device.fault().find("'aeb-controller' closed its connection"), std::string::npos);
}

TEST(CanDevice, SafeValuesAreSentAfterAStationIsLost) {
  const TemporaryFolder folder;
  auto hub = std::make_unique<virtual_bus::Hub>(hub_config(1));
  process::Child controller(controller_config(hub->address(), folder));
  SetClock clock;
  CanDeviceConfig config = crossing_config();
  config.log_file = folder / "frames.log";
  const auto log_file = config.log_file;
  CanDevice device(std::move(config), std::move(hub));
  device.start(clock, Pacing::lockstep);
  device.release_outputs(std::vector<double>(device.outputs().size(), 7.0), 0);
  ASSERT_TRUE(device.exchange(0));
  controller.stop(1'000 * ms);
  EXPECT_FALSE(device.exchange(ms));
  device.enter_safe_state();
  device.stop();
  std::vector<bool> safe;
  for (const LoggedFrame& logged : read_candump_log(log_file).frames) {
    if (logged.frame.raw.can_id == 0x100)
      safe.push_back(logged.frame.raw.data[0] == 0 && logged.frame.raw.data[1] == 0);
  }
  EXPECT_EQ(safe, (std::vector{false, true}));
}

TEST(CanDevice, SafeValuesAreSentOnce) {
  const TemporaryFolder folder;
  auto hub = std::make_unique<virtual_bus::Hub>(hub_config(0));
  SetClock clock;
  CanDeviceConfig config = crossing_config();
  config.send[0].safe_values["Speed"] = 2.5;
  config.log_file = folder / "frames.log";
  const auto log_file = config.log_file;
  {
    CanDevice device(std::move(config), std::move(hub));
    device.start(clock, Pacing::lockstep);
    std::vector<double> outputs(device.outputs().size(), 7.0);
    device.release_outputs(outputs, 0);
    ASSERT_TRUE(device.exchange(0));
    device.enter_safe_state();
    device.stop();
    EXPECT_EQ(device.counters().tx, 6U);
  }
  const CandumpLog log = read_candump_log(log_file);
  ASSERT_EQ(log.frames.size(), 6U);
  EXPECT_EQ(log.frames[0].frame.raw.data[0] + 256 * log.frames[0].frame.raw.data[1], 700);
  EXPECT_EQ(log.frames[3].frame.raw.data[0] + 256 * log.frames[3].frame.raw.data[1], 250);
}

class RealtimeDevice : public ::testing::Test {
 protected:
  void start(CanDeviceConfig config) {
    auto hub = std::make_unique<virtual_bus::Hub>(hub_config(0));
    address_ = hub->address();
    hub_ = hub.get();
    device_ = std::make_unique<CanDevice>(std::move(config), std::move(hub));
    device_->start(clock_, Pacing::realtime);
    samples_.resize(device_->inputs().size());
    outputs_.resize(device_->outputs().size());
  }
  template <typename Condition>
  bool eventually(const Condition& condition) {
    return tests::eventually([&] {
      device_->latch_inputs(samples_);
      return condition();
    });
  }
  const Sample& sample(const char* name) { return samples_[channel(device_->inputs(), name)]; }

  const TemporaryFolder folder_;
  RunningClock clock_;
  virtual_bus::Hub* hub_ = nullptr;
  std::string address_;
  std::unique_ptr<CanDevice> device_;
  std::vector<Sample> samples_;
  std::vector<double> outputs_;
};

TEST_F(RealtimeDevice, ControllerReplyBecomesStaleAfterItEnds) {
  start(crossing_config());
  process::Child controller(controller_config(address_, folder_));
  ASSERT_TRUE(eventually([&] { return hub_->station_count() == 1; }));
  const RunTimeNs begin = clock_.now_ns();
  std::int64_t tick = 0;
  int replies = 0;
  double last_reply = -1.0;
  EXPECT_TRUE(eventually([&] {
    if (clock_.now_ns() >= begin + tick * 10 * ms) {
      set_danger(*device_, outputs_, 2.0);
      device_->release_outputs(outputs_, begin + tick++ * 10 * ms);
    }
    const Sample& request = sample("ObjectHeader.Counter");
    const Sample& reply = sample("BrakeCommand.AnswerTo");
    if (!reply.fresh || request.value != reply.value || reply.value == last_reply) return false;
    EXPECT_GE(reply.time_ns, request.time_ns);
    last_reply = reply.value;
    return ++replies >= 5;
  }));
  EXPECT_GT(sample("BrakeCommand.Deceleration").value, 3.0);
  controller.stop(1'000 * ms);
  EXPECT_TRUE(eventually([&] { return !sample("BrakeCommand.Deceleration").fresh; }));
  EXPECT_EQ(sample("BrakeCommand.Deceleration").value, 1.5) << "the safe value";
  device_->stop();
  EXPECT_EQ(device_->counters().bad_checksum + device_->counters().bad_counter, 0U);
}

TEST_F(RealtimeDevice, InvalidFramesAreCountedAndValidOnesAccepted) {
  start(crossing_config());
  virtual_bus::Station outside({address_, "outside"});
  outside.open(clock_, Pacing::realtime);
  const Dbc database = load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  MessageEncoder encoder(*database.find_message("BrakeCommand"), protection);
  MessageEncoder::Tally tally;
  const auto build = [&] { return encoder.build(std::vector<double>{4.0, 0.0, 0.0, 3.0, 0.0, 0.0}, tally); };
  const Frame good = build();
  Frame bad_checksum = good;
  bad_checksum.raw.data[1] ^= 0x10U;
  outside.send(make_frame(0x300, {}));
  outside.send(make_frame(0x300 | CAN_RTR_FLAG, {}));
  outside.send(make_frame(0x555, {}));
  outside.send(make_frame(0x300 | CAN_EFF_FLAG, good.payload()));
  outside.send(bad_checksum);
  outside.send(good);
  outside.send(good);  // a repeated counter
  ASSERT_TRUE(eventually([&] { return device_->counters().rx == 7; }));
  const CanCounters counters = device_->counters();
  EXPECT_EQ(counters.wrong_kind, 1U);
  EXPECT_EQ(counters.unknown_id, 2U);
  EXPECT_EQ(counters.bad_checksum, 2U) << "one of them is too short to carry it";
  EXPECT_EQ(counters.bad_counter, 1U);
  EXPECT_TRUE(eventually([&] { return sample("BrakeCommand.Deceleration").value == 4.0; }));
  EXPECT_TRUE(device_->connected());
}

TEST_F(RealtimeDevice, KeptArrivalsHaveTheirTimeAndLostOnesAreCounted) {
  constexpr int frames = 9000;  // more than it keeps
  auto hub = std::make_unique<virtual_bus::Hub>(hub_config(0));
  virtual_bus::Station outside({hub->address(), "outside"});
  CanDevice device(crossing_config(), std::move(hub));
  const std::size_t answers = channel(device.inputs(), "BrakeCommand.AnswerTo");
  const std::size_t counter = channel(device.inputs(), "ObjectHeader.Counter");
  ASSERT_TRUE(device.keep_arrivals(answers));
  ASSERT_TRUE(device.keep_arrivals(counter));
  device.start(clock_, Pacing::realtime);
  outside.open(clock_, Pacing::realtime);
  const Dbc database = load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  MessageEncoder encoder(*database.find_message("BrakeCommand"), protection);
  MessageEncoder::Tally tally;
  outputs_.resize(device.outputs().size());
  for (int i = 0; i < frames; ++i) {
    const Frame frame =
        encoder.build(std::vector<double>{0.0, 0.0, 0.0, static_cast<double>(i), 0.0, 0.0}, tally);
    while (outside.send(frame) != SendResult::sent)
      std::this_thread::yield();
    encoder.confirm_sent();
    if (i == 3) device.release_outputs(outputs_, 0);
    // In step with the hub, so that the bus drops no frame.
    while (device.counters().rx < static_cast<std::uint64_t>(i))
      std::this_thread::yield();
  }
  EXPECT_TRUE(tests::eventually([&] { return device.counters().rx >= frames; }));
  std::vector<InputValue> values(device.inputs().size());
  std::uint64_t taken = 0, sent_counters = 0;
  EXPECT_FALSE(device.next_arrival(values)) << "no tick has latched a value";
  std::vector<Sample> samples(values.size());
  ASSERT_TRUE(tests::eventually([&] {
    device.latch_inputs(samples);
    return samples[answers].value == frames - 1;
  }));
  RunTimeNs last_ns = std::numeric_limits<RunTimeNs>::min();
  while (const auto arrival = device.next_arrival(values)) {
    ASSERT_GE(arrival->time_ns, last_ns);
    last_ns = arrival->time_ns;
    const auto arrived = std::span(values).first(arrival->count);
    if (arrived.front().input == counter) {
      EXPECT_EQ(arrival->count, 1U) << "a sent counter arrives alone, with its send instant";
      ++sent_counters;
      continue;
    }
    EXPECT_GT(arrival->count, 1U) << "all signals of the message arrive at once";
    const auto answer = std::ranges::find(arrived, answers, &InputValue::input);
    ASSERT_NE(answer, arrived.end());
    ASSERT_EQ(answer->value, static_cast<double>(taken++));
  }
  EXPECT_EQ(sent_counters, 1U);
  EXPECT_EQ(taken + sent_counters, 8192U);
  EXPECT_EQ(device.lost_arrivals(), frames - taken);
}

TEST_F(RealtimeDevice, InvalidOutputsAreCountedAndNeverSent) {
  start(crossing_config());
  outputs_[channel(device_->outputs(), "EgoStatus.Speed")] = 1000.0;
  outputs_[channel(device_->outputs(), "EgoStatus.YawRate")] = std::nan("");
  device_->release_outputs(outputs_, 0);
  EXPECT_TRUE(eventually([&] { return device_->counters().tx == 3; }));
  EXPECT_EQ(device_->counters().saturated, 1U);
  EXPECT_EQ(device_->counters().refused_values, 1U);
}

TEST_F(RealtimeDevice, StopSendsEarlierReleasesAndMayBeRepeated) {
  CanDeviceConfig config = crossing_config();
  config.send[0].period_ns = 0;
  config.log_file = folder_ / "frames.log";
  const auto log_file = config.log_file;
  start(std::move(config));
  for (int tick = 0; tick < 20; ++tick)
    device_->release_outputs(outputs_, tick * ms);
  device_->stop();
  device_->stop();
  EXPECT_EQ(device_->counters().tx, 22U);
  EXPECT_EQ(read_candump_log(log_file).frames.size(), 22U);
}

TEST_F(RealtimeDevice, ReportsALogThatCanNotBeWritten) {
  CanDeviceConfig config = crossing_config();
  config.log_file = "/dev/full";
  start(std::move(config));
  device_->release_outputs(outputs_, 0);
  device_->stop();
  EXPECT_NE(device_->log_fault().find("No space left"), std::string::npos) << device_->log_fault();
  EXPECT_GT(device_->counters().log_dropped, 0U);
}

TEST(CanDevice, PeriodsFollowTheReleasesWithoutDrift) {
  CanDeviceConfig config = crossing_config();
  config.send = {{"EgoStatus", 10 * ms, 5 * ms, protection, {}}};
  auto owned = std::make_unique<DrivenBus>();
  const DrivenBus& bus = *owned;
  SetClock clock;
  CanDevice device(std::move(config), std::move(owned));
  device.start(clock, Pacing::lockstep);
  const std::vector<double> outputs(device.outputs().size(), 0.0);
  std::vector<RunTimeNs> sent_at;
  for (RunTimeNs now = 0; now < 100 * ms; now += 3 * ms) {
    device.release_outputs(outputs, now);
    const std::size_t before = bus.sent.size();
    device.exchange(now);
    if (bus.sent.size() > before) sent_at.push_back(now / ms);
  }
  EXPECT_EQ(sent_at, (std::vector<RunTimeNs>{6, 15, 27, 36, 45, 57, 66, 75, 87, 96}));
}

}  // namespace
}  // namespace hil::io::can
