#pragma once
// A bounded FIFO of arrivals, each with the values that came at once, from a device's thread to the tick
// thread.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "io/device.hpp"

namespace hil::io {

/// Threads: one producer, one consumer; both are wait-free and allocate nothing.
class ArrivalRing {
 public:
  /// `max_values`: of one arrival.
  ArrivalRing(std::size_t capacity, std::size_t max_values)
      : width_(max_values), arrivals_(capacity + 1), values_(arrivals_.size() * max_values) {}

  /// False when the ring is full; the arrival is then dropped. Misuse: more than max_values.
  bool push(std::span<const InputValue> values, RunTimeNs time_ns) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    const std::size_t next = (tail + 1) % arrivals_.size();
    if (next == head_.load(std::memory_order_acquire)) return false;
    std::ranges::copy(values, values_of(tail).begin());
    arrivals_[tail] = {time_ns, values.size()};
    tail_.store(next, std::memory_order_release);
    return true;
  }

  /// Copies the oldest arrival to the front of `values` and removes it. Empty: there is none.
  std::optional<Arrival> take(std::span<InputValue> values) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return std::nullopt;
    const Arrival arrival = arrivals_[head];
    std::ranges::copy(values_of(head).first(arrival.count), values.begin());
    head_.store((head + 1) % arrivals_.size(), std::memory_order_release);
    return arrival;
  }

 private:
  std::span<InputValue> values_of(std::size_t index) noexcept {
    return std::span(values_).subspan(index * width_, width_);
  }

  const std::size_t width_;
  std::vector<Arrival> arrivals_;
  std::vector<InputValue> values_;
  std::atomic<std::size_t> head_{0};
  std::atomic<std::size_t> tail_{0};
};

}  // namespace hil::io
