#pragma once
// Why a run finished after its deadline. The time from its release to its finish is taken apart into delays,
// and the cause is the largest of them. Two rules keep the blame fair:
//  - the run's own CPU time counts only above what it is allowed: its budget, or without one its whole
//    deadline;
//  - when a run waited for the run before it of the same task, that wait counts for whatever delayed that
//    one.

#include <array>
#include <cstddef>
#include <cstdint>

namespace hil::executive {

enum class MissCause : std::uint8_t {
  late_wakeup,   ///< the kernel woke the base thread, or the task's thread, late
  own_work,      ///< the step used more CPU time than its budget (without a budget: than its deadline)
  database,      ///< the step waited for the database
  earlier_task,  ///< it started late because of what ran before it: hooks and tasks of this tick or of one
                 ///< that overran
  preempted,     ///< it was neither computing nor waiting for the database: another thread had the CPU, or it
                 ///< slept
  page_fault,    ///< the same, with a page fault that waited for a disk; or many small ones
  host_pause,    ///< the whole process stood still: stopped by a signal, or the host took the CPU away
};
inline constexpr std::size_t miss_cause_count = 7;

/// The name as it stands in report.json.
const char* to_string(MissCause cause) noexcept;

/// Delays by cause, in nanoseconds. Sums to at most the time from release to finish.
class DelayParts {
 public:
  std::int64_t& operator[](MissCause cause) noexcept { return parts_ns_[static_cast<std::size_t>(cause)]; }
  std::int64_t operator[](MissCause cause) const noexcept {
    return parts_ns_[static_cast<std::size_t>(cause)];
  }
  /// The cause with the largest part; own_work when there is no delay at all.
  MissCause largest() const noexcept;

 private:
  std::array<std::int64_t, miss_cause_count> parts_ns_{};
};

/// The cost assumed for one page fault served from memory. (About right for a virtual machine with nested
/// paging.)
inline constexpr std::int64_t minor_fault_ns = 1'000;

/// What is known about a run. Instants are on the executive's clock, in the order they happened.
struct RunEvidence {
  std::int64_t release_ns = 0;      ///< when the run should have begun
  std::int64_t base_wake_ns = 0;    ///< when the base thread last came out of sleep
  std::int64_t ready_ns = 0;        ///< when the base thread got to the task: ran it or woke its thread
  std::int64_t thread_free_ns = 0;  ///< when the task's thread had finished its run before this one
  std::int64_t start_ns = 0;
  std::int64_t finish_ns = 0;
  std::int64_t deadline_ns = 0;  ///< from the release
  std::int64_t budget_ns = 0;    ///< 0: none
  std::int64_t cpu_ns = 0;
  std::int64_t blocked_ns = 0;
  std::int64_t minor_faults = 0;
  std::int64_t major_faults = 0;
  std::int64_t pause_before_start_ns = 0;  ///< how long the host stood still between release and start
  std::int64_t pause_in_step_ns = 0;       ///< and between start and finish
  std::int64_t standstill_in_step_ns = 0;  ///< there, for how long no thread of the process ran, at least
  /// The run before it of the same task, if that one ran past this release: until when, and what delayed it.
  std::int64_t same_task_until_ns = 0;
  MissCause same_task_cause = MissCause::own_work;
};

DelayParts take_apart(const RunEvidence& run) noexcept;

}  // namespace hil::executive
