#pragma once
// How the log's thread sleeps and is woken. It sleeps until there is anything at all, or, when what there is may wait for more, until
// a time or something urgent. Ringing costs a system call only where it wakes.
//
// Who rings a sleeper first claims to wake it, and the others go on: on a machine that is busy it may be long until the woken
// thread runs, and commits come by the thousand meanwhile.
//
// Threads: one sleeps; ringing is anybody's, neither allocates nor blocks.

#include <atomic>
#include <cstdint>

#include <rtstdb/time.hpp>

#include "rtstdb/threads/futex.hpp"

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
    begin_sleep(Sleep::until_rung);
    threads::futex_wait(rings_, heard.rings);
    end_sleep();
  }
  /// The same, but so long at the most.
  void sleep(Heard heard, Nanoseconds at_most) noexcept {
    begin_sleep(Sleep::until_rung);
    threads::futex_wait_for(rings_, heard.rings, at_most);
    end_sleep();
  }
  /// Until it is rung urgently, or was since `heard`, or so long.
  void doze(Heard heard, Nanoseconds at_most) noexcept {
    begin_sleep(Sleep::until_urgent);
    threads::futex_wait_for(urgent_rings_, heard.urgent_rings, at_most);
    end_sleep();
  }

  void ring() noexcept {
    // Pairs with begin_sleep: either the ring is seen there or the sleeper is seen here.
    rings_.fetch_add(1, std::memory_order_seq_cst);
    wake_from(Sleep::until_rung, rings_);
  }
  void ring_urgently() noexcept {
    urgent_rings_.fetch_add(1, std::memory_order_seq_cst);
    ring();
    wake_from(Sleep::until_urgent, urgent_rings_);
  }

 private:
  enum class Sleep : std::uint8_t { none, until_rung, until_urgent };

  void begin_sleep(Sleep kind) noexcept { sleeps_.store(kind, std::memory_order_seq_cst); }
  void end_sleep() noexcept { sleeps_.store(Sleep::none, std::memory_order_relaxed); }

  void wake_from(Sleep kind, std::atomic<std::uint32_t>& rings) noexcept {
    Sleep seen = kind;
    if (sleeps_.load(std::memory_order_seq_cst) != kind ||
        !sleeps_.compare_exchange_strong(seen, Sleep::none, std::memory_order_seq_cst))
      return;
    // The sleeper may have heard this ring before it lay down, and lie down after the wake: then this one keeps it up.
    rings.fetch_add(1, std::memory_order_seq_cst);
    threads::futex_wake_all(&rings);
  }

  std::atomic<std::uint32_t> rings_{0}, urgent_rings_{0};
  std::atomic<Sleep> sleeps_{Sleep::none};
};

}  // namespace rtstdb::transaction
