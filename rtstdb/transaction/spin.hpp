#pragma once
// Looking for a short while whether something has happened, before a thread goes to sleep: to be woken takes longer than
// most transactions do. Only where the other can run meanwhile, and only as long as it pays.

#include <rtstdb/time.hpp>

#include "rtstdb/transaction/monotonic_clock.hpp"

namespace rtstdb::transaction {

/// How long threads of this process may spin: `wanted`, or not at all where they have one processor only.
Nanoseconds spin_where_possible(Nanoseconds wanted) noexcept;

/// Whether the calling thread is scheduled in real time: it would keep those from running that it waits for. A system call.
bool is_realtime_thread() noexcept;

/// One thread's experience. After some spins in vain it is only tried now and then; not at all in a thread that is scheduled in
/// real time, from 10 ms after it became one.
class Spin {
 public:
  /// Until `happened` says yes: true; or for so long, or since it is not tried: false. Neither blocks nor allocates.
  template <class Happened>
  bool until(Nanoseconds most, Happened happened) noexcept {
    if (most <= Nanoseconds(0) || !pays()) return happened();
    const MonotonicClock clock;
    const ClockTime begin = clock.now();
    if (starves_others(begin)) return happened();
    const ClockTime end = begin + most;
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
  static constexpr int try_again_after = 64;
  int credit_ = gain;
  int left_out_ = 0;
  static constexpr Nanoseconds asked_again_after{10'000'000};
  ClockTime asked_at_{};  // the kernel, for the thread's policy
  bool realtime_ = false;
};

}  // namespace rtstdb::transaction
