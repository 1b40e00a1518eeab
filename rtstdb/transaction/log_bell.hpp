#pragma once
// How the log's thread sleeps and is woken: it sleeps until any ring, or, when its work may wait for more, until a time or an
// urgent ring. Ringing makes a system call only where it wakes the thread.
//
// The first thread that rings a sleeper claims to wake it, and the others make no system call: on a busy machine the woken
// thread may run much later, and many commits ring before that.
//
// Threads: one sleeps; any rings. Ringing neither allocates nor blocks.

#include <atomic>
#include <cstdint>

#include <rtstdb/time.hpp>

#include "rtstdb/threads/futex.hpp"

namespace rtstdb::transaction {

class LogBell {
 public:
  struct Counts {
    std::uint32_t rings = 0, urgent_rings = 0;
  };
  /// The rings so far. To be read before the thread looks for work.
  Counts counts() const noexcept {
    return {rings_.load(std::memory_order_seq_cst), urgent_rings_.load(std::memory_order_seq_cst)};
  }
  /// Until a ring, or not at all where one came since `seen`.
  void sleep(Counts seen) noexcept {
    begin_sleep(Sleep::until_rung);
    threads::futex_wait(rings_, seen.rings);
    end_sleep();
  }
  /// The same, at most for this long.
  void sleep(Counts seen, Nanoseconds at_most) noexcept {
    begin_sleep(Sleep::until_rung);
    threads::futex_wait_for(rings_, seen.rings, at_most);
    end_sleep();
  }
  /// Until an urgent ring, at most for this long; not at all where one came since `seen`.
  void sleep_until_urgent(Counts seen, Nanoseconds at_most) noexcept {
    begin_sleep(Sleep::until_urgent);
    threads::futex_wait_for(urgent_rings_, seen.urgent_rings, at_most);
    end_sleep();
  }

  void ring() noexcept {
    // Pairs with begin_sleep: either the sleeper sees the ring, or this thread sees the sleeper.
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
    // The sleeper may read this ring as seen and sleep after the wake-up: another count keeps it from sleeping.
    rings.fetch_add(1, std::memory_order_seq_cst);
    threads::futex_wake_all(&rings);
  }

  std::atomic<std::uint32_t> rings_{0}, urgent_rings_{0};
  std::atomic<Sleep> sleeps_{Sleep::none};
};

}  // namespace rtstdb::transaction
