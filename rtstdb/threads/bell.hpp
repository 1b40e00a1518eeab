#pragma once
// One thread sleeps, others wake it when there is something to look at. Ringing neither allocates nor waits.

#include <atomic>
#include <cstdint>

#include "rtstdb/threads/futex.hpp"

namespace rtstdb::threads {

class Bell {
 public:
  void ring() noexcept {
    // Pairs with sleep_unless_rung: either the ring is heard there or the sleeper is seen here.
    rung_.fetch_add(1, std::memory_order_seq_cst);
    if (asleep_.load(std::memory_order_seq_cst)) futex_wake_all(&rung_);
  }
  /// The one thread: before it looks at what there is.
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
