#pragma once
// A lock-free queue of events with a fixed size, from the follower to the thread that fetches them. The
// atomics for popped events are sequentially consistent with the flag of a producer that waits for room, so
// that no wake-up is lost.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/standing.hpp>

namespace rtstdb::standing {

class EventRing {
 public:
  explicit EventRing(std::size_t capacity) : events_(capacity) {}

  std::size_t capacity() const noexcept { return events_.size(); }
  /// Producer: number of free places.
  std::size_t space() const noexcept {
    return events_.size() - static_cast<std::size_t>(pushed_.load(std::memory_order_relaxed) -
                                                     popped_.load(std::memory_order_seq_cst));
  }
  /// Producer. Misuse without room.
  void push(const StandingEvent& event) noexcept {
    const std::uint64_t place = pushed_.load(std::memory_order_relaxed);
    events_[place % events_.size()] = event;
    pushed_.store(place + 1, std::memory_order_release);
  }
  /// Consumer: takes the oldest events and returns their number.
  std::size_t pop(std::span<StandingEvent> events) noexcept {
    const std::uint64_t first = popped_.load(std::memory_order_relaxed);
    const auto waiting = static_cast<std::size_t>(pushed_.load(std::memory_order_acquire) - first);
    const std::size_t count = std::min(waiting, events.size());
    for (std::size_t k = 0; k < count; ++k)
      events[k] = events_[(first + k) % events_.size()];
    popped_.store(first + count, std::memory_order_seq_cst);
    return count;
  }

 private:
  alignas(64) std::atomic<std::uint64_t> pushed_{0};
  std::vector<StandingEvent> events_;
  alignas(64) std::atomic<std::uint64_t> popped_{0};
};

}  // namespace rtstdb::standing
