#pragma once
// What the executive reads from the kernel about the calling thread and the host. A port, so that a test can
// simulate preemption and stolen time.

#include <cstdint>

namespace hil::executive {

struct PageFaults {
  std::int64_t minor = 0;  ///< served from memory
  std::int64_t major = 0;  ///< waited for a disk
};

class Probe {
 public:
  virtual ~Probe() = default;
  /// CPU time of the calling thread. In the tick.
  virtual std::int64_t thread_cpu_ns() const noexcept = 0;
  /// Page faults of the calling thread so far. In the tick.
  virtual PageFaults thread_faults() const noexcept = 0;
  /// The clock as an ordinary thread sees it; the accounting thread looks for gaps in it. Ordinary threads
  /// only.
  virtual std::int64_t host_now_ns() const noexcept = 0;
  /// CPU time of all threads of this process. Ordinary threads only.
  virtual std::int64_t process_cpu_ns() const noexcept = 0;
  /// The total time that the host has taken from this machine's CPUs. Ordinary threads only.
  virtual std::int64_t host_steal_ns() const noexcept = 0;
};

/// CLOCK_THREAD_CPUTIME_ID, getrusage(RUSAGE_THREAD), CLOCK_MONOTONIC, CLOCK_PROCESS_CPUTIME_ID and
/// /proc/stat.
class SystemProbe final : public Probe {
 public:
  SystemProbe() noexcept;
  ~SystemProbe() override;
  SystemProbe(const SystemProbe&) = delete;
  SystemProbe& operator=(const SystemProbe&) = delete;

  std::int64_t thread_cpu_ns() const noexcept override;
  PageFaults thread_faults() const noexcept override;
  std::int64_t host_now_ns() const noexcept override;
  std::int64_t process_cpu_ns() const noexcept override;
  std::int64_t host_steal_ns() const noexcept override;

 private:
  int stat_file_ = -1;
  std::int64_t ns_per_jiffy_ = 0;
};

/// The mean cost of one reading of the calling thread's CPU time and page faults.
std::int64_t measure_reading_ns(const Probe& probe) noexcept;

}  // namespace hil::executive
