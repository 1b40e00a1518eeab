// The counters and the log of a CAN device on a virtual bus with injected faults.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "io/can/can_device.hpp"
#include "io/virtual/hub.hpp"
#include "io/virtual/station.hpp"
#include "tests/paths.h"
#include "tests/support/simulation/run_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::io::can {
namespace {

constexpr std::int64_t ms = 1'000'000;

/// The counters, and the frames of the log that were sent and received.
struct Logged {
  CanCounters counters;
  std::size_t tx = 0, rx = 0;
};

Logged logged_under(const virtual_bus::FaultConfig& faults) {
  auto hub =
      std::make_unique<virtual_bus::Hub>(virtual_bus::HubConfig{.name = "car", .path = {}, .faults = faults});
  virtual_bus::Station outside({hub->address(), "outside"});
  const tests::TemporaryFolder folder;
  const auto log_file = folder / "frames.log";
  CanDeviceConfig config;
  config.name = "car";
  config.database = load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  config.send.push_back({"EgoStatus", 10 * ms, 0, {}, {}});
  config.send.push_back({"ObjectHeader", 50 * ms, 0, {}, {}});
  config.log_file = log_file;
  SetClock clock;
  CanDevice device(std::move(config), std::move(hub));
  device.start(clock, Pacing::lockstep);
  outside.open(clock, Pacing::lockstep);
  std::atomic<bool> over{false};
  std::thread listener([&] {
    Frame frame;
    while (!over.load()) {
      while (outside.receive(frame) == ReceiveResult::frame) {
        if (frame.raw.can_id == 0x100) outside.send(make_frame(0x555, {}));
      }
      std::this_thread::yield();
    }
  });
  std::vector<double> outputs(device.outputs().size(), 0.0);
  for (int tick = 0; tick < 300; ++tick) {
    clock.set(tick * 10 * ms);
    device.release_outputs(outputs, clock.now_ns());
    EXPECT_TRUE(device.exchange(clock.now_ns())) << device.fault();
  }
  device.stop();
  over.store(true);
  listener.join();
  Logged logged{device.counters()};
  for (const LoggedFrame& frame : read_candump_log(log_file).frames)
    ++(frame.frame.raw.can_id == 0x555 ? logged.rx : logged.tx);
  return logged;
}

TEST(CanDevice, InjectedFaultsAreCountedAndTheLogHoldsTheOtherFrames) {
  const Logged lossy = logged_under(
      {.drop_probability = 0.2, .corrupt_probability = 0.1, .delay_probability = 0.0, .seed = 3});
  EXPECT_EQ(lossy.counters.tx, 360U);
  EXPECT_GT(lossy.counters.injected.dropped_tx, 40U);
  EXPECT_EQ(lossy.counters.tx, lossy.tx + lossy.counters.injected.dropped_tx);
  EXPECT_EQ(lossy.counters.rx, lossy.rx);
  EXPECT_GT(lossy.counters.rx, 100U);
  EXPECT_GT(lossy.counters.injected.dropped_rx, 20U);
  EXPECT_GT(lossy.counters.injected.corrupted, 20U);
  EXPECT_EQ(lossy.counters.dropped, 0U);

  const Logged silent = logged_under({.drop_probability = 1.0});
  EXPECT_EQ(silent.counters.injected.dropped_tx, 360U);
  EXPECT_EQ(silent.tx + silent.rx, 0U);
  EXPECT_EQ(silent.counters.bus_load_peak, 0.0);

  const Logged delayed = logged_under({.delay_probability = 1.0, .delay_ns = 25 * ms});
  EXPECT_GE(delayed.counters.injected.delayed, 360U);
  EXPECT_GT(delayed.counters.injected.dropped_tx, 0U) << "still held back at the end";
  EXPECT_EQ(delayed.counters.tx, delayed.tx + delayed.counters.injected.dropped_tx);
}

}  // namespace
}  // namespace hil::io::can
