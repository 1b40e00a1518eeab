#pragma once
// Why a run finished after its deadline. The time from its release to its finish is divided into delays, and
// the cause is the largest delay. Two rules:
//   - The run's own CPU time counts only as far as it exceeds its budget, or without a budget its deadline.
//   - If a run waited for the previous run of the same task, that wait counts as whatever delayed the
//     previous run.

#include <array>
#include <cstddef>
#include <cstdint>

namespace hil::executive {

enum class MissCause : std::uint8_t {
  late_wake_up,  ///< the kernel woke the base thread, or the task's thread, late
  own_work,      ///< the step used more CPU time than its budget (without a budget: than its deadline)
  database,      ///< the step waited for the database
  /// It started late because of what ran before it: hooks and tasks of this tick, or of one that overran.
  earlier_task,
  /// It neither computed nor waited for the database: another thread had the CPU, or the step slept.
  preempted,
  page_fault,  ///< likewise, with a page fault that waited for a disk, or with many small ones
  host_pause,  ///< the whole process was stopped, by a signal or by the host
};
inline constexpr std::size_t miss_cause_count = 7;

/// Its words in report.json and in texts: "late wake-up".
const char* to_string(MissCause cause) noexcept;

/// Delays by cause, in nanoseconds. Their sum is at most the time from release to finish.
class DelayParts {
 public:
  std::int64_t& operator[](MissCause cause) noexcept { return parts_ns_[static_cast<std::size_t>(cause)]; }
  std::int64_t operator[](MissCause cause) const noexcept {
    return parts_ns_[static_cast<std::size_t>(cause)];
  }
  /// The cause with the largest delay; own_work when there is no delay.
  MissCause largest() const noexcept;

 private:
  std::array<std::int64_t, miss_cause_count> parts_ns_{};
};

/// The assumed cost of one page fault that is served from memory; typical for a virtual machine with nested
/// paging.
inline constexpr std::int64_t minor_fault_ns = 1'000;

/// The evidence about a run. Instants are times of the executive's clock, in the order in which they
/// occurred.
struct RunEvidence {
  std::int64_t release_ns = 0;      ///< planned start of the run
  std::int64_t base_wake_ns = 0;    ///< end of the base thread's last sleep
  std::int64_t ready_ns = 0;        ///< when the base thread ran the task or woke its thread
  std::int64_t thread_free_ns = 0;  ///< when the task's thread had finished its previous run
  std::int64_t start_ns = 0;
  std::int64_t finish_ns = 0;
  std::int64_t deadline_ns = 0;  ///< relative to the release
  std::int64_t budget_ns = 0;    ///< 0: none
  std::int64_t cpu_ns = 0;
  std::int64_t blocked_ns = 0;
  std::int64_t minor_faults = 0;
  std::int64_t major_faults = 0;
  std::int64_t pause_before_start_ns = 0;  ///< pauses of the host between release and start
  std::int64_t pause_in_step_ns = 0;       ///< pauses of the host between start and finish
  /// Lower bound on the time there in which no thread of the process ran
  std::int64_t process_pause_in_step_ns = 0;
  /// The previous run of the same task, if it ran past this release: its end, and its delays.
  std::int64_t same_task_until_ns = 0;
  MissCause same_task_cause = MissCause::own_work;
};

DelayParts attribute_delay(const RunEvidence& run) noexcept;

}  // namespace hil::executive
