#pragma once
// The crossing's CAN device, and a bus that a test drives.

#include <cstdint>
#include <string>
#include <vector>

#include "io/can/can_device.hpp"
#include "tests/paths.h"

namespace hil::io::can {

inline constexpr std::int64_t ms = 1'000'000;
inline const Protection protection{"Counter", "Checksum"};

inline CanDeviceConfig crossing_config() {
  CanDeviceConfig config;
  config.name = "car";
  config.database = load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database;
  config.send.push_back({"EgoStatus", 10 * ms, 0, protection, {}});
  config.send.push_back({"Object0", 100 * ms, 0, {}, {}});
  config.send.push_back({"ObjectHeader", 100 * ms, 0, protection, {}});
  config.receive.push_back({"BrakeCommand", 250 * ms, protection, {{"Deceleration", 1.5}}});
  return config;
}

/// A bus that accepts no frame while `full` or `error` is set, and delivers the frames of `arriving`.
class DrivenBus final : public CanTransport {
 public:
  const std::string& name() const noexcept override { return name_; }
  std::string description() const override { return name_; }
  void open(const RunClock&, Pacing) override {}
  void close() noexcept override {}
  int fd() const noexcept override { return -1; }
  SendResult send(const Frame& frame) noexcept override {
    ++tries;
    if (full) return SendResult::no_buffer;
    if (error != 0) return SendResult::error;
    sent.push_back(frame);
    return SendResult::sent;
  }
  int send_error() const noexcept override { return error; }
  ReceiveResult receive(Frame& frame) noexcept override {
    if (arriving.empty()) return ReceiveResult::empty;
    frame = arriving.front();
    arriving.erase(arriving.begin());
    return ReceiveResult::frame;
  }
  void set_filters(std::span<const can_filter>) override {}
  ExchangeResult exchange(RunTimeNs) override { return {}; }
  BusCounters counters() const noexcept override { return {}; }
  std::string fault() const override { return {}; }

  bool full = false;
  int error = 0;  ///< of every send, when it is not 0
  int tries = 0;
  std::vector<Frame> sent, arriving;

 private:
  std::string name_ = "full";
};

}  // namespace hil::io::can
