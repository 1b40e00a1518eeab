// Run time as devices see it, from the opening of a run into its first ticks.

#include "runtime/run/clocks.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "io/can/can_device.hpp"
#include "io/virtual/hub.hpp"
#include "io/virtual/station.hpp"
#include "tests/paths.h"
#include "tests/support/eventually.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t s = 1'000'000'000;

TEST(DeviceClock, IsNegativeBeforeTheFirstTickAndNeverDecreases) {
  executive::VirtualClock machine;
  machine.sleep_until(40 * s);
  DeviceClock clock(machine);
  std::vector<io::RunTimeNs> seen;
  for (int second = 0; second < 3; ++second) {  // the run opens
    seen.push_back(clock.now_ns());
    machine.sleep_until(machine.now_ns() + s);
  }
  clock.set_origin(machine.now_ns() + s);
  seen.push_back(clock.now_ns());
  EXPECT_EQ(seen.back(), -s);
  EXPECT_EQ(seen[1] - seen[0], s);
  for (std::size_t i = 1; i < seen.size(); ++i) {
    EXPECT_LT(seen[i - 1], 0);
    EXPECT_GE(seen[i], seen[i - 1]) << "look " << i;
  }
  machine.sleep_until(machine.now_ns() + 3 * s);
  EXPECT_EQ(clock.now_ns(), 2 * s);
}

TEST(DeviceClock, ConvertsTimesOfTheOpeningToTimesBeforeTheFirstTick) {
  executive::VirtualClock machine;
  machine.sleep_until(40 * s);
  DeviceClock clock(machine);
  machine.sleep_until(41 * s);
  const io::RunTimeNs stamp = clock.now_ns();
  EXPECT_EQ(clock.to_run_time(stamp), stamp) << "the origin is not known yet";
  clock.set_origin(45 * s);
  EXPECT_EQ(clock.to_run_time(stamp), -4 * s);
  EXPECT_EQ(clock.to_run_time(-s), -s);
  EXPECT_EQ(clock.to_run_time(7 * s), 7 * s);
  EXPECT_EQ(clock.to_run_time(INT64_MIN), INT64_MIN) << "never";
}

TEST(DeviceClock, ReportsEventsOfTheOpeningAtTheFirstTick) {
  executive::VirtualClock machine;
  DeviceClock clock(machine);
  EXPECT_EQ(clock.report_ns(), 0);
  clock.set_origin(2 * s);
  EXPECT_EQ(clock.report_ns(), 0);
  machine.sleep_until(5 * s);
  EXPECT_EQ(clock.report_ns(), 3 * s);
}

/// A station of a CAN bus and the device that receives its frames, during the opening of a run.
class OpeningBus : public ::testing::Test {
 protected:
  void SetUp() override {
    io::can::CanDeviceConfig config;
    config.name = "car";
    config.database = io::can::load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
    config.receive.push_back({"BrakeCommand", 200 * ms, {}, {}});
    auto hub = std::make_unique<io::virtual_bus::Hub>(
        io::virtual_bus::HubConfig{.name = "car", .path = {}, .faults = {}});
    station_.emplace(io::virtual_bus::StationConfig{.address = hub->address(), .name = "ecu"});
    device_.emplace(std::move(config), std::move(hub));
    device_->start(clock_, io::Pacing::realtime);
    station_->open(clock_, io::Pacing::realtime);
    pass(2 * s);  // the GPU opens
  }
  void TearDown() override { device_->stop(); }

  void pass(std::int64_t duration_ns) { machine_.sleep_until(machine_.now_ns() + duration_ns); }
  void send_and_wait() {
    const std::vector<std::uint8_t> payload(8);
    station_->send(io::can::make_frame(768, payload));
    EXPECT_TRUE(tests::eventually([&] { return newest().fresh; }));
  }
  io::Sample newest() {
    std::vector<io::Sample> samples(device_->inputs().size());
    device_->latch_inputs(samples);
    return samples[0];
  }

  executive::VirtualClock machine_;
  DeviceClock clock_{machine_};
  std::optional<io::virtual_bus::Station> station_;
  std::optional<io::can::CanDevice> device_;
};

TEST_F(OpeningBus, StationThatStoppedDuringTheOpeningIsNotFresh) {
  send_and_wait();
  pass(300 * ms);
  clock_.set_origin(machine_.now_ns() + ms);
  const io::Sample sample = newest();
  EXPECT_FALSE(sample.fresh);
  EXPECT_EQ(sample.time_ns, -301 * ms);
}

TEST_F(OpeningBus, FrameBeforeTheFirstTickIsFreshForItsTimeOut) {
  send_and_wait();
  pass(50 * ms);
  clock_.set_origin(machine_.now_ns() + ms);
  EXPECT_TRUE(newest().fresh);
  EXPECT_EQ(newest().time_ns, -51 * ms);
  pass(149 * ms);
  EXPECT_TRUE(newest().fresh);
  pass(2 * ms);
  EXPECT_FALSE(newest().fresh);
}

}  // namespace
}  // namespace hil::run
