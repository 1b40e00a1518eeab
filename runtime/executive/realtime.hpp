#pragma once
// Real-time scheduling of the executive's threads. What the machine refuses is not an error: the run
// continues without it, and `degraded` lists it.
//
// The order matters, since threads inherit the affinity of the thread that creates them, and locking memory
// affects the whole process:
//   1. Create everything that creates threads or large mappings: Vulkan device, I/O devices, loggers.
//   2. Then call Executive::run, which applies the options to the base thread and the tasks' threads and
//      reverts them.
// The policy is not inherited (SCHED_RESET_ON_FORK), so a thread that a library creates in the tick is an
// ordinary one; but it would be bound to the executive's CPUs.

#include <sched.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hil::executive {

enum class Scheduler : std::uint8_t { other, fifo };

struct RealtimeOptions {
  Scheduler scheduler = Scheduler::other;
  /// Priority of the base thread, 2 to 99. Tasks' threads have lower priorities, rate-monotonic: the shorter
  /// the period, the higher the priority.
  int priority = 60;
  /// Locks all present and future memory of the process, so that no page fault in the tick waits for a disk.
  bool lock_memory = false;
  std::vector<int> cpus;  ///< CPUs for the base thread and the tasks' threads; empty: any
};

/// The reason why the options are refused, with the values; empty: they are valid.
std::optional<std::string> why_refused(const RealtimeOptions& options);

/// Which of the options were applied.
struct RealtimeOutcome {
  Scheduler scheduler = Scheduler::other;
  int priority = 0;  ///< of the base thread; 0 without SCHED_FIFO
  bool memory_locked = false;
  std::vector<int> cpus;  ///< as applied; empty: any
  std::vector<std::string>
      degraded;  ///< what was refused or what the machine lacks, one sentence each, without repetition
};

/// Adds a sentence unless the list contains it.
void add_once(std::vector<std::string>& sentences, std::string sentence);

/// During its lifetime applies policy, affinity and a fine timer slack to the thread that creates it, which
/// must also destroy it. Touches the thread's stack, so that it is mapped before the tick.
class ThreadRealtime {
 public:
  ThreadRealtime(const RealtimeOptions& options, int priority);
  ~ThreadRealtime();
  ThreadRealtime(const ThreadRealtime&) = delete;
  ThreadRealtime& operator=(const ThreadRealtime&) = delete;

  bool fifo() const noexcept { return fifo_; }
  bool bound_to_cpus() const noexcept { return bound_; }
  const std::vector<std::string>& refused() const noexcept { return refused_; }

 private:
  void bind_to(const std::vector<int>& cpus);
  void become_fifo(int priority);

  bool fifo_ = false;
  bool bound_ = false;
  int policy_before_ = 0;
  sched_param parameters_before_{};
  cpu_set_t cpus_before_{};
  int timer_slack_before_ns_ = -1;
  std::vector<std::string> refused_;
};

/// During its lifetime locks memory and keeps CPUs out of deep sleep (/dev/cpu_dma_latency), for the whole
/// process.
class ProcessRealtime {
 public:
  explicit ProcessRealtime(const RealtimeOptions& options);
  ~ProcessRealtime();
  ProcessRealtime(const ProcessRealtime&) = delete;
  ProcessRealtime& operator=(const ProcessRealtime&) = delete;

  bool memory_locked() const noexcept { return memory_locked_; }
  const std::vector<std::string>& refused() const noexcept { return refused_; }

 private:
  void lock_memory();
  void keep_cpus_awake();

  bool memory_locked_ = false;
  int cpu_latency_file_ = -1;
  std::vector<std::string> refused_;
};

}  // namespace hil::executive
