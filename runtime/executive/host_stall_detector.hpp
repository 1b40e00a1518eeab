#pragma once
// Tells whether the whole process stood still. One thread alone can not know: when it wakes late, another
// thread may have had its CPU. The witness is an ordinary thread that sleeps for a fixed time again and again
// and notes when it overslept; if the thread in question was off the CPU over the same stretch, both stood
// still. Time stolen by the host, as the kernel counts it, is evidence too, as exact as the kernel's 10 ms.
//
// A machine so busy that it starves an ordinary thread and the thread in question alike looks the same from
// here. A thread that waited for another of this process (the database's) was off the CPU anyway; there it counts
// that no thread of the process ran.
//
// Threads: one.

#include <array>
#include <cstddef>
#include <cstdint>

namespace hil::executive {

class HostStallDetector {
 public:
  /// Sleeping longer than asked by less than this is ordinary scheduling.
  static constexpr std::int64_t smallest_pause_ns = 2'000'000;

  /// The witness meant to sleep until `wake_ns` and came back at `now_ns`. `process_ran_ns`: CPU time of all threads of
  /// the process since it lay down.
  void note_sleep(std::int64_t wake_ns, std::int64_t now_ns, std::int64_t process_ran_ns) noexcept;
  /// The kernel's total of stolen time. The first call only sets where to count from.
  void note_steal(std::int64_t now_ns, std::int64_t steal_total_ns) noexcept;

  /// How much of a stretch in which a thread was off the CPU for `off_cpu_ns` was a pause of the host. 0 when
  /// there is no evidence, or when the thread was off the CPU for less than half of what the witness saw.
  std::int64_t pause_ns(std::int64_t begin_ns, std::int64_t end_ns, std::int64_t off_cpu_ns) const noexcept;
  /// For how much of a stretch no thread of the process ran while one wanted to, at least.
  std::int64_t standstill_ns(std::int64_t begin_ns, std::int64_t end_ns) const noexcept;

 private:
  struct Pause {
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
    std::int64_t length_ns = 0;  ///< at most end - begin
    std::int64_t standstill_ns = 0;
    bool stolen = false;  ///< as the kernel counts; such pauses do not overlap, so they add up
  };
  void keep(const Pause& pause) noexcept;

  static constexpr std::size_t kept_pauses =
      256;  // far more than fall between a run and its record being read
  std::array<Pause, kept_pauses> pauses_{};
  std::size_t next_ = 0;
  bool steal_known_ = false;
  std::int64_t steal_total_ns_ = 0;
  std::int64_t steal_read_ns_ = 0;
};

}  // namespace hil::executive
