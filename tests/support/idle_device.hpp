#pragma once
// A device without channels that is always connected and does nothing; tests override some of its functions.

#include <string>

#include "io/device.hpp"

namespace hil::tests {

class IdleDevice : public io::Device {
 public:
  explicit IdleDevice(std::string name) : name_(std::move(name)) {}
  const std::string& name() const noexcept override { return name_; }
  std::span<const io::ChannelInfo> inputs() const noexcept override { return {}; }
  std::span<const io::InputGroup> input_groups() const noexcept override { return {}; }
  io::RunTimeNs loss_timeout_ns() const noexcept override { return 0; }
  std::span<const io::ChannelInfo> outputs() const noexcept override { return {}; }
  void start(const io::RunClock& /*clock*/, io::Pacing /*pacing*/) override {}
  void latch_inputs(std::span<io::Sample> /*samples*/) noexcept override {}
  void release_outputs(std::span<const double> /*values*/, io::RunTimeNs /*tick_ns*/) noexcept override {}
  bool exchange(io::RunTimeNs /*tick_ns*/) override { return true; }
  void enter_safe_state() noexcept override {}
  void stop() noexcept override {}
  bool connected() const noexcept override { return true; }
  std::string fault() const override { return {}; }
  std::string send_fault() const override { return {}; }

 private:
  const std::string name_;
};

}  // namespace hil::tests
