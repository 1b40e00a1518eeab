#pragma once
// Slots that the tick fills in turn, and that an ordinary thread writes to files.
//
// Threads: slots at setup; begin and finish in the tick, without allocation; write_filled on one ordinary
// thread at a time; close after the last tick.

#include <array>
#include <atomic>
#include <cstdint>

namespace hil::run {

template <class Slot>
class WriteRing {
 public:
  /// `waits`: under the virtual clock, where begin() waits for a slot and none is lost.
  explicit WriteRing(bool waits) noexcept : waits_(waits) {}

  std::array<Slot, 3>& slots() noexcept { return slots_; }

  /// The slot to fill. Null: all slots wait for the disk, or the ring is closed; the loss is counted.
  Slot* begin() noexcept {
    const std::uint64_t place = filled_.load(std::memory_order_relaxed);
    std::uint64_t written = written_.load(std::memory_order_acquire);
    while (waits_ && !is_closed_.load(std::memory_order_relaxed) && place - written == slots_.size()) {
      written_.wait(written, std::memory_order_acquire);
      written = written_.load(std::memory_order_acquire);
    }
    if (is_closed_.load(std::memory_order_relaxed) || place - written == slots_.size()) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return nullptr;
    }
    return &slots_[place % slots_.size()];
  }
  /// Hands over the slot of the last begin().
  void finish() noexcept {
    filled_.store(filled_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Calls write(slot) for each filled slot, in their order.
  template <class Write>
  void write_filled(Write&& write) {
    const std::uint64_t end = filled_.load(std::memory_order_acquire);
    for (std::uint64_t place = written_.load(std::memory_order_relaxed); place < end; ++place) {
      write(slots_[place % slots_.size()]);
      written_.store(place + 1, std::memory_order_release);
      written_.notify_one();
    }
  }
  /// From now on begin() returns null.
  void close() noexcept { is_closed_.store(true, std::memory_order_relaxed); }
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  const bool waits_;
  std::array<Slot, 3> slots_{};
  std::atomic<std::uint64_t> filled_{0}, written_{0}, lost_{0};
  std::atomic<bool> is_closed_{false};
};

}  // namespace hil::run
