#pragma once
// An event count: one thread sleeps until another thread has notified it. To notify neither allocates nor
// blocks.
//
// The sleeping thread reads heard(), then looks for work, and sleeps only if nothing was notified since that
// reading, so that no notification is lost.

#include <atomic>
#include <cstdint>

#include "rtstdb/threads/futex.hpp"

namespace rtstdb::threads {

class Bell {
 public:
  void ring() noexcept {
    // Pairs with sleep_unless_rung by sequential consistency: either that sees the new count, or this sees
    // the sleeper.
    rung_.fetch_add(1, std::memory_order_seq_cst);
    if (asleep_.load(std::memory_order_seq_cst)) futex_wake_all(&rung_);
  }
  /// The sleeping thread calls it before it looks for work.
  std::uint32_t heard() const noexcept { return rung_.load(std::memory_order_seq_cst); }
  void sleep_unless_rung(std::uint32_t heard) noexcept {
    asleep_.store(true, std::memory_order_seq_cst);
    futex_wait(rung_, heard);
    asleep_.store(false, std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint32_t> rung_{0};
  std::atomic<bool> asleep_{false};
};

}  // namespace rtstdb::threads
