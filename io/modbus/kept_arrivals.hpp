#pragma once
// The values of registers that a device keeps one by one for the tick: those of each request.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "io/device.hpp"
#include "io/handover/arrival_ring.hpp"

namespace hil::io::modbus {

/// Threads: keep before the start; add and complete from the device's thread; take from the tick thread;
/// lost on any.
class KeptArrivals {
 public:
  void keep(std::size_t input, std::size_t inputs) {
    if (ring_ == nullptr) {
      ring_ = std::make_unique<ArrivalRing>(capacity, inputs);
      keeps_.resize(inputs);
      arriving_.reserve(inputs);
    }
    keeps_[input] = true;
  }

  /// A value of the request that is being handled; left out unless it is kept.
  void add(std::size_t input, double value) {
    if (ring_ != nullptr && keeps_[input]) arriving_.push_back({input, value});
  }
  /// The request has no further value.
  void complete(RunTimeNs time_ns) noexcept {
    if (arriving_.empty()) return;
    if (!ring_->push(arriving_, time_ns)) lost_.fetch_add(1, std::memory_order_relaxed);
    arriving_.clear();
  }

  std::optional<Arrival> take(std::span<InputValue> values) noexcept {
    return ring_ == nullptr ? std::nullopt : ring_->take(values);
  }
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t capacity = 8192;
  std::unique_ptr<ArrivalRing> ring_;  ///< null: nothing is kept
  std::vector<bool> keeps_;            ///< by input
  std::vector<InputValue> arriving_;
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace hil::io::modbus
