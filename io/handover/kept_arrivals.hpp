#pragma once
// The arrivals that a device keeps one by one for the tick: each frame, or the registers of each request. At
// most max_kept_arrivals wait; newer ones are dropped and counted. A tick takes those whose values it has
// latched, and no later one: the device publishes its values with completed(), and latch() takes that number.
// What arrives after the device sent its safe values is a reply to them, and no part of the run.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "io/device.hpp"
#include "io/handover/arrival_ring.hpp"

namespace hil::io {

/// The newest values of a device, and how many kept arrivals they contain.
template <typename Values>
struct ValuesOfArrivals {
  Values values{};
  std::uint64_t arrivals = 0;
};

/// Threads: keep before the start; add, complete, completed and end from the device's thread, latch and take
/// from the tick thread, all without allocation; lost on any. begin and latch_all while the device's thread
/// does not run.
class KeptArrivals {
 public:
  /// Keeps `count` inputs from `first` on. `max_values`: the most kept values of one arrival.
  void keep(std::size_t first, std::size_t count, std::size_t max_values) {
    keeps_.resize(std::max(keeps_.size(), first + count));
    std::fill_n(keeps_.begin() + static_cast<std::ptrdiff_t>(first), count, true);
    if (ring_ != nullptr && arriving_.capacity() >= max_values) return;
    arriving_.reserve(max_values);
    ring_ = std::make_unique<ArrivalRing>(max_kept_arrivals, arriving_.capacity());
  }

  /// Adds a value to the arrival that is being decoded, if its input is kept.
  void add(std::size_t input, double value) noexcept {
    if (input < keeps_.size() && keeps_[input]) arriving_.push_back({input, value});
  }
  /// The arrival has no further value.
  void complete(RunTimeNs time_ns) noexcept {
    if (arriving_.empty()) return;
    if (has_ended_) return arriving_.clear();
    if (ring_->push(arriving_, time_ns)) {
      ++completed_;
    } else {
      lost_.fetch_add(1, std::memory_order_relaxed);
    }
    arriving_.clear();
  }
  /// The safe values are sent: nothing is kept until the next begin.
  void end() noexcept { has_ended_ = true; }
  void begin() noexcept { has_ended_ = false; }
  /// The number of inputs that are kept.
  std::size_t kept_inputs() const noexcept {
    return static_cast<std::size_t>(std::ranges::count(keeps_, true));
  }
  /// How many arrivals were completed and not lost.
  std::uint64_t completed() const noexcept { return completed_; }

  /// The tick has the values of the first `completed` arrivals.
  void latch(std::uint64_t completed) noexcept { latched_ = completed; }
  void latch_all() noexcept { latched_ = completed_; }
  /// Removes the oldest latched arrival and copies its values to the front of `values`. Empty: there is none.
  std::optional<Arrival> take(std::span<InputValue> values) noexcept {
    if (taken_ == latched_) return std::nullopt;
    ++taken_;
    return ring_->take(values);
  }
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  std::unique_ptr<ArrivalRing> ring_;  ///< null: nothing is kept
  std::vector<bool> keeps_;            ///< by input; may be shorter
  std::vector<InputValue> arriving_;
  std::uint64_t completed_ = 0;
  bool has_ended_ = false;
  std::uint64_t latched_ = 0, taken_ = 0;  ///< tick thread
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace hil::io
