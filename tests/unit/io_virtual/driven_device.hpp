#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "driven_bus.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::can {

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

  SetClock clock_;
  DrivenBus* bus_ = nullptr;
  std::unique_ptr<CanDevice> device_;
};

}  // namespace hil::io::can
