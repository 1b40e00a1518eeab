#pragma once
// Real-time scheduling of the executive's threads. What the machine refuses is no error: the run goes on
// without it, and says so in `degraded`.
//
// Order matters. Threads inherit the affinity of the thread that makes them, and locked memory is for the
// whole process:
//   1. create the Vulkan device, device and I/O threads, loggers: whatever makes threads or large mappings;
//   2. then call Executive::run, which applies all this to the base thread and the tasks' threads and takes
//      it back.
// The policy itself is not inherited (SCHED_RESET_ON_FORK), so a library that makes a thread in the tick gets
// an ordinary one; but that thread would be bound to the executive's CPUs.

#include <sched.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hil::executive {

enum class Scheduler : std::uint8_t { other, fifo };

struct RealtimeOptions {
  Scheduler scheduler = Scheduler::other;
  /// Of the base thread, 2 to 99. Tasks' threads lie below it, rate-monotonic: the shorter the period, the
  /// higher.
  int priority = 60;
  /// Locks all memory of the process, present and future, so that no page is ever fetched in the tick.
  bool lock_memory = false;
  std::vector<int> cpus;  ///< where the base thread and the tasks' threads may run; empty: anywhere
};

/// What is wrong with the options, in words with the values.
std::optional<std::string> why_refused(const RealtimeOptions& options);

/// What became of them.
struct RealtimeOutcome {
  Scheduler scheduler = Scheduler::other;
  int priority = 0;  ///< of the base thread; 0 without SCHED_FIFO
  bool memory_locked = false;
  std::vector<int> cpus;  ///< as applied; empty: anywhere
  std::vector<std::string>
      degraded;  ///< what was refused or what this machine lacks, each once, in clear words
};

/// Adds a sentence unless it is there.
void add_once(std::vector<std::string>& sentences, std::string sentence);

/// For its life: policy, affinity and a fine timer for the thread that makes it, which also has to end it.
/// Touches the thread's stack, so that the tick finds it mapped.
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

/// For its life: memory locked, and CPUs kept from deep sleep (/dev/cpu_dma_latency), for the whole process.
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
