#pragma once
// Detects that the whole process did not run. A late thread alone can not know this, since another thread may
// have had its CPU. An ordinary thread therefore sleeps repeatedly for a fixed time and notes when it
// overslept. If the late thread was off the CPU during the same interval, both were stopped. Time stolen by
// the host, as the kernel counts it, is further evidence, with the kernel's resolution of 10 ms.
//
// A machine that starves both threads with other load can not be distinguished from a stopped one. A thread
// that waits for another thread of the process (the database's) is off the CPU anyway; for it the detector
// uses the time in which no thread of the process ran.
//
// Threads: one.

#include <array>
#include <cstddef>
#include <cstdint>

namespace hil::executive {

class HostPauseDetector {
 public:
  /// Oversleeping by less than this is ordinary scheduling.
  static constexpr std::int64_t smallest_pause_ns = 2'000'000;

  /// Notes that the sleeping thread wanted to wake at `wake_ns` and woke at `now_ns`. `process_ran_ns`: CPU
  /// time of all threads of the process since the sleep began.
  void note_sleep(std::int64_t wake_ns, std::int64_t now_ns, std::int64_t process_ran_ns) noexcept;
  /// Notes the kernel's total of stolen time. The first call sets the reference.
  void note_steal(std::int64_t now_ns, std::int64_t steal_total_ns) noexcept;

  /// How much of an interval, in which a thread was off the CPU for `off_cpu_ns`, was a pause of the host. 0
  /// without evidence, or when the thread was off the CPU for less than half of the detected pause.
  std::int64_t pause_ns(std::int64_t begin_ns, std::int64_t end_ns, std::int64_t off_cpu_ns) const noexcept;
  /// A lower bound on the time in the interval during which no thread of the process ran although one was
  /// ready.
  std::int64_t process_pause_ns(std::int64_t begin_ns, std::int64_t end_ns) const noexcept;

 private:
  struct Pause {
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
    std::int64_t length_ns = 0;  ///< at most end - begin
    std::int64_t process_pause_ns = 0;
    bool stolen = false;  ///< as counted by the kernel; such pauses do not overlap, so their lengths add up
  };
  void add(const Pause& pause) noexcept;

  static constexpr std::size_t max_pauses =
      256;  // more than can occur between a run and the reading of its record
  std::array<Pause, max_pauses> pauses_{};
  std::size_t next_ = 0;
  bool steal_known_ = false;
  std::int64_t steal_total_ns_ = 0;
  std::int64_t steal_read_ns_ = 0;
};

}  // namespace hil::executive
