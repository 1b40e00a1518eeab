#pragma once
// A bounded FIFO of rows of values, each with a time, between the tick thread and a device's thread: the
// outputs of ticks in one direction, samples that are kept individually in the other.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <span>
#include <vector>

#include "io/device.hpp"

namespace hil::io {

/// Threads: one producer, one consumer; both are wait-free and allocate nothing.
class TimedRowRing {
 public:
  TimedRowRing(std::size_t capacity, std::size_t values_per_row)
      : width_(values_per_row), times_(capacity + 1) {
    values_.resize(times_.size() * width_);
  }

  /// False when the ring is full; the row is then dropped.
  bool push(std::span<const double> values, RunTimeNs time_ns) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    const std::size_t next = (tail + 1) % times_.size();
    if (next == head_.load(std::memory_order_acquire)) return false;
    std::copy(values.begin(), values.end(), row(tail).begin());
    times_[tail] = time_ns;
    tail_.store(next, std::memory_order_release);
    return true;
  }

  /// Calls `use(values, time_ns)` with the oldest row and removes it. False when there is none.
  template <typename Use>
  bool take(const Use& use) {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    use(std::span<const double>(row(head)), times_[head]);
    head_.store((head + 1) % times_.size(), std::memory_order_release);
    return true;
  }

 private:
  std::span<double> row(std::size_t index) noexcept {
    return std::span(values_).subspan(index * width_, width_);
  }

  std::size_t width_;
  std::vector<RunTimeNs> times_;
  std::vector<double> values_;
  std::atomic<std::size_t> head_{0};
  std::atomic<std::size_t> tail_{0};
};

}  // namespace hil::io
