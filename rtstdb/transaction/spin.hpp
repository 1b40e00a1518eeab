#pragma once
// Polling for a short time before a thread sleeps: a wake-up takes longer than most transactions. A thread
// polls only where the thread that it waits for can run at the same time, and only while polling succeeds
// often enough.

#include <rtstdb/time.hpp>

#include "rtstdb/transaction/monotonic_clock.hpp"

namespace rtstdb::transaction {

/// How long the threads of a database spin. A longer time gains for large commits and loses for programs that
/// share the processors.
inline constexpr Nanoseconds default_spin{30'000};

/// How long threads of this process may spin: `wanted`, or zero where the process has one processor.
Nanoseconds spin_where_possible(Nanoseconds wanted) noexcept;

/// Whether the calling thread has a real-time policy: it would keep threads from running that it waits for. A
/// system call.
bool is_realtime_thread() noexcept;

/// The spinning of one thread, with its record of success: after some failures it spins only rarely. A thread
/// with a real-time policy does not spin, from 10 ms after it got the policy.
class Spin {
 public:
  /// Polls `happened` for at most `timeout`. Returns what it returned last. Neither blocks nor allocates.
  template <class Happened>
  bool until(Nanoseconds timeout, Happened happened) noexcept {
    if (timeout <= Nanoseconds(0) || !pays()) return happened();
    const MonotonicClock clock;
    const ClockTime begin = clock.now();
    if (starves_others(begin)) return happened();
    const ClockTime end = begin + timeout;
    bool found = happened();
    while (!found && clock.now() < end) {
      for (int k = 0; k < 16 && !found; ++k) {
        pause();
        found = happened();
      }
    }
    note(found);
    return found;
  }

 private:
  static void pause() noexcept;
  bool pays() noexcept;
  bool starves_others(ClockTime now) noexcept;
  void note(bool found) noexcept;

  static constexpr int max_credit = 32;
  static constexpr int gain = 4;
  static constexpr int max_skipped = 64;
  int credit_ = gain;
  int skipped_ = 0;
  static constexpr Nanoseconds policy_check_interval{10'000'000};
  ClockTime policy_checked_at_{};
  bool realtime_ = false;
};

}  // namespace rtstdb::transaction
