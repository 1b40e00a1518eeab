#pragma once
// A device whose frames a test makes.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tests/support/idle_device.hpp"

namespace hil::expectations {

class ArrivingDevice final : public tests::IdleDevice, public io::ArrivalSource {
 public:
  /// `kept_inputs`: the first inputs, whose arrivals it can keep.
  explicit ArrivingDevice(std::size_t kept_inputs) : IdleDevice("device"), kept_inputs_(kept_inputs) {}

  void receive(std::vector<io::InputValue> values, std::int64_t time_ns) {
    frames_.push_back({std::move(values), time_ns});
  }
  void receive(std::size_t input, double value, std::int64_t time_ns) { receive({{input, value}}, time_ns); }
  void lose(std::uint64_t count) { lost_ += count; }

  io::ArrivalSource* arrival_source() noexcept override { return this; }
  bool keep_arrivals(std::size_t input) override { return input < kept_inputs_; }
  std::optional<io::Arrival> next_arrival(std::span<io::InputValue> values) noexcept override {
    if (taken_ == frames_.size()) return std::nullopt;
    const Frame& frame = frames_[taken_++];
    std::ranges::copy(frame.values, values.begin());
    return io::Arrival{frame.time_ns, frame.values.size()};
  }
  std::uint64_t lost_arrivals() const noexcept override { return lost_; }

 private:
  struct Frame {
    std::vector<io::InputValue> values;
    std::int64_t time_ns;
  };
  const std::size_t kept_inputs_;
  std::deque<Frame> frames_;
  std::size_t taken_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace hil::expectations
