#pragma once
// Connects a device to the signals of a run: its inputs become signals at the beginning of every tick, and
// a task with the device's rate releases its outputs. Under the virtual clock the same task exchanges
// frames with the device in lock-step.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/executive/task.hpp"
#include "runtime/signals/links.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::run {

class DeviceLink final : public executive::Task {
 public:
  using Source = signals::Source;
  using Links = signals::Links;

  DeviceLink(io::Device& device, Links links, signals::SignalTable& table, io::Pacing pacing);

  io::Device& device() const noexcept { return device_; }
  /// To be called by the base thread at the beginning of every tick.
  void latch_inputs(std::int64_t time_ns) noexcept;
  /// Whether an input of the group was fresh when inputs were latched last. Base thread.
  bool is_fresh(std::size_t group) const noexcept { return fresh_[group] != 0; }
  bool is_fresh_input(std::size_t input) const noexcept { return samples_[input].fresh; }
  /// The time of the newest value of these inputs, as they were latched last. Base thread.
  std::int64_t newest_ns(std::size_t first, std::size_t count) const noexcept {
    return std::ranges::max(std::span(samples_).subspan(first, count), {}, &io::Sample::time_ns).time_ns;
  }
  /// Base thread. While `hold` is true, step() releases the safe values of the outputs instead of their
  /// signals.
  void hold_safe_values(bool hold) noexcept { holds_safe_values_ = hold; }
  /// Releases the outputs of this tick; in lock-step also waits for the answers. An output whose signal is
  /// unknown (NaN) keeps its value, before its first one the safe one. Does nothing once such an exchange
  /// failed.
  void step(const executive::TickInfo& tick) noexcept override;
  /// False once a lock-step exchange failed: the other side does not answer.
  bool in_step() const noexcept { return in_step_; }

 private:
  io::Device& device_;
  const Links links_;
  signals::SignalTable& table_;
  const io::Pacing pacing_;
  struct ObservedOutput {
    io::SendCycle cycle;
    signals::ReadObserver* observer = nullptr;
  };
  std::vector<ObservedOutput> observed_outputs_;
  io::RunTimeNs last_release_ns_ = std::numeric_limits<io::RunTimeNs>::min();
  std::vector<io::Sample> samples_;
  std::vector<std::uint8_t> fresh_;  ///< by input group
  std::vector<double> values_;
  bool in_step_ = true;
  bool holds_safe_values_ = false;
};

}  // namespace hil::run
