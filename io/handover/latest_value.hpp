#pragma once
// The newest state, handed from one thread to one other without either ever waiting: three slots, of which
// the writer owns one, the reader owns one, and the third changes hands in one atomic exchange. Older states
// that nobody took are lost, which is what registers mean.

#include <array>
#include <atomic>
#include <cstdint>

namespace hil::io {

template <class State>
class LatestValue {
 public:
  /// All slots start as copies of `prototype`; nothing is allocated later if filling a slot does not
  /// allocate.
  explicit LatestValue(const State& prototype) : slots_{prototype, prototype, prototype} {}

  /// As if constructed anew. Neither side may be at work.
  void reset(const State& prototype) {
    slots_.fill(prototype);
    writers_ = 0;
    shared_.store(1);
    readers_ = 2;
  }

  /// Writer: the slot to fill. It holds some older state, not necessarily the last published.
  State& draft() noexcept { return slots_[writers_]; }
  /// Writer: makes the draft the newest state. True when this replaced one that the reader never took.
  bool publish() noexcept {
    const std::uint8_t old = shared_.exchange(writers_ | untaken, std::memory_order_acq_rel);
    writers_ = old & index_mask;
    return (old & untaken) != 0;
  }

  /// Reader: moves on to the newest state. False when there is none newer than current().
  bool take_newest() noexcept {
    if ((shared_.load(std::memory_order_relaxed) & untaken) == 0) return false;
    readers_ = shared_.exchange(readers_, std::memory_order_acq_rel) & index_mask;
    return true;
  }
  /// Reader: the state last taken; the prototype before the first.
  const State& current() const noexcept { return slots_[readers_]; }

 private:
  static constexpr std::uint8_t untaken = 4;
  static constexpr std::uint8_t index_mask = 3;

  std::array<State, 3> slots_;
  std::uint8_t writers_ = 0;
  std::atomic<std::uint8_t> shared_{1};
  std::uint8_t readers_ = 2;
};

}  // namespace hil::io
