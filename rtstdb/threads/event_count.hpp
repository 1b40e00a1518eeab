#pragma once
// An event count: one thread sleeps until another thread has notified it. To notify neither allocates nor
// blocks.
//
// The sleeping thread reads count(), then looks for work, and sleeps only if nothing was notified since that
// reading, so that no notification is lost.

#include <atomic>
#include <cstdint>

#include "rtstdb/threads/futex.hpp"

namespace rtstdb::threads {

class EventCount {
 public:
  /// Any thread.
  void notify() noexcept {
    // Pairs with wait by sequential consistency: either that sees the new count, or this sees
    // the sleeper.
    count_.fetch_add(1, std::memory_order_seq_cst);
    if (waiting_.load(std::memory_order_seq_cst)) futex_wake_all(&count_);
  }
  /// The sleeping thread calls it before it looks for work.
  std::uint32_t count() const noexcept { return count_.load(std::memory_order_seq_cst); }
  /// Sleeps until a notification after count() returned `seen`.
  void wait(std::uint32_t seen) noexcept {
    waiting_.store(true, std::memory_order_seq_cst);
    futex_wait(count_, seen);
    waiting_.store(false, std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint32_t> count_{0};
  std::atomic<bool> waiting_{false};
};

}  // namespace rtstdb::threads
