#pragma once
// Hands the newest state from one thread to another without blocking either. There are three slots: one
// belongs to the writer, one to the reader, and the third changes owner in one atomic exchange. A state that
// is replaced before it is read is lost, which suits registers (triple buffering).

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

  /// Equivalent to a new construction. Neither side may use the object during the call.
  void reset(const State& prototype) {
    slots_.fill(prototype);
    writer_slot_ = 0;
    shared_.store(1);
    reader_slot_ = 2;
  }

  /// Writer: the slot to fill. It holds an older state, not necessarily the one published last.
  State& draft() noexcept { return slots_[writer_slot_]; }
  /// Writer: publishes the draft. True when it replaced a state that was never read.
  bool publish() noexcept {
    const std::uint8_t old = shared_.exchange(writer_slot_ | untaken, std::memory_order_acq_rel);
    writer_slot_ = old & index_mask;
    return (old & untaken) != 0;
  }

  /// Reader: switches to the newest state. False when none is newer than current().
  bool take_newest() noexcept {
    if ((shared_.load(std::memory_order_relaxed) & untaken) == 0) return false;
    reader_slot_ = shared_.exchange(reader_slot_, std::memory_order_acq_rel) & index_mask;
    return true;
  }
  /// Reader: the state taken last; the prototype before that.
  const State& current() const noexcept { return slots_[reader_slot_]; }

 private:
  static constexpr std::uint8_t untaken = 4;
  static constexpr std::uint8_t index_mask = 3;

  std::array<State, 3> slots_;
  std::uint8_t writer_slot_ = 0;
  std::atomic<std::uint8_t> shared_{1};
  std::uint8_t reader_slot_ = 2;
};

}  // namespace hil::io
