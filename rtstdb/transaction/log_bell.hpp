#pragma once
// How the log's thread sleeps and is woken. It sleeps until there is anything at all, or, when what there is may wait for more, until
// a time or something urgent. Ringing costs a system call only where it wakes.
//
// Threads: one sleeps; ringing is anybody's, neither allocates nor blocks.

#include <atomic>
#include <cstdint>

#include <rtstdb/time.hpp>

#include "rtstdb/transaction/futex.hpp"

namespace rtstdb::transaction {

class LogBell {
 public:
  struct Heard {
    std::uint32_t rings = 0, urgent_rings = 0;
  };
  /// Before looking for what there is to do.
  Heard hear() const noexcept {
    return {rings_.load(std::memory_order_seq_cst), urgent_rings_.load(std::memory_order_seq_cst)};
  }
  /// Until it is rung, or was since `heard`.
  void sleep(Heard heard) noexcept {
    sleeps_.store(Sleep::until_rung, std::memory_order_seq_cst);
    futex_wait(rings_, heard.rings);
    sleeps_.store(Sleep::none, std::memory_order_relaxed);
  }
  /// Until it is rung urgently, or was since `heard`, or so long.
  void doze(Heard heard, Nanoseconds at_most) noexcept {
    sleeps_.store(Sleep::until_urgent, std::memory_order_seq_cst);
    futex_wait_for(urgent_rings_, heard.urgent_rings, at_most);
    sleeps_.store(Sleep::none, std::memory_order_relaxed);
  }

  void ring() noexcept {
    // Pairs with the sleeps: either the ring is seen there or the sleeper is seen here.
    rings_.fetch_add(1, std::memory_order_seq_cst);
    if (sleeps_.load(std::memory_order_seq_cst) == Sleep::until_rung) futex_wake_all(&rings_);
  }
  void ring_urgently() noexcept {
    urgent_rings_.fetch_add(1, std::memory_order_seq_cst);
    ring();
    if (sleeps_.load(std::memory_order_seq_cst) == Sleep::until_urgent) futex_wake_all(&urgent_rings_);
  }

 private:
  enum class Sleep : std::uint8_t { none, until_rung, until_urgent };
  std::atomic<std::uint32_t> rings_{0}, urgent_rings_{0};
  std::atomic<Sleep> sleeps_{Sleep::none};
};

}  // namespace rtstdb::transaction
