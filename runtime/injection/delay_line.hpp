#pragma once
// Values of the past, of which a signal is delayed.
//
// Threads: one at a time; neither keep() nor at() allocates.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/signals/signal_table.hpp"

namespace hil::injection {

/// Values of the past, one for each tick.
class DelayLine {
 public:
  /// `capacity`: the number of ticks of the delay and two more.
  explicit DelayLine(std::size_t capacity) : ring_(capacity) {}

  /// Times are strictly increasing.
  void keep(const signals::SignalValue& value, std::int64_t time_ns) noexcept {
    ring_[count_++ % ring_.size()] = {value, time_ns};
  }
  /// The last one that is not after the time; the first one when all are.
  signals::SignalValue at(std::int64_t time_ns, const signals::SignalValue& now) noexcept {
    if (count_ == 0) return now;
    const std::uint64_t oldest = count_ > ring_.size() ? count_ - ring_.size() : 0;
    next_ = std::max(next_, oldest);
    while (next_ + 1 < count_ && ring_[(next_ + 1) % ring_.size()].time_ns <= time_ns)
      ++next_;
    return ring_[next_ % ring_.size()].value;
  }

 private:
  struct Entry {
    signals::SignalValue value;
    std::int64_t time_ns = 0;
  };
  std::vector<Entry> ring_;
  std::uint64_t count_ = 0, next_ = 0;
};

}  // namespace hil::injection
