#pragma once
// The executive runs tasks at integer divisions of a base rate, in real time or under a virtual clock, and
// accounts for every run. Simulated time never lags silently behind real time: up to `catch_up_ticks` late
// ticks run back to back, and further ones are skipped and reported. Under the virtual clock a tick is late
// only by Task::added_ns.
//
// One tick, on the base thread (the thread that calls run):
//   begin hook (latches device inputs)
//   -> publishes the outputs of other threads' tasks that are due
//   -> tasks in the order in which they were added (base thread: latch, step, publish; other threads: latch,
//      wake the thread)
//   -> end hook (releases device outputs)
//
// A deadline miss and an overrun are different things. Deadline miss: a run finished after its deadline.
// Overrun: a run had not finished when the task's next release arrived. Slack is deadline - response time;
// positive slack means in time.
//
// Threads: one thread configures and runs; any thread may call live() during run().

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/executive/accounting.hpp"
#include "runtime/executive/clock.hpp"
#include "runtime/executive/live.hpp"
#include "runtime/executive/probe.hpp"
#include "runtime/executive/realtime.hpp"
#include "runtime/executive/result.hpp"
#include "runtime/executive/task.hpp"
#include "runtime/executive/watchdog.hpp"

namespace hil::executive {

/// What happens before and after the tasks of each tick, on the base thread. `tick.run` is the number of
/// ticks that ran before.
class TickHooks {
 public:
  virtual ~TickHooks() = default;
  /// Called once before the first tick, which is at most one period away. `start_ns` is the clock at run time
  /// 0.
  virtual void before_first_tick(std::int64_t start_ns) noexcept { (void)start_ns; }
  virtual void begin_tick(const TickInfo& tick) noexcept { (void)tick; }
  virtual void end_tick(const TickInfo& tick) noexcept { (void)tick; }
};

struct ExecutiveOptions {
  std::int64_t base_period_ns = 1'000'000;
  std::uint64_t duration_ticks = 0;  ///< 0: until a stop is requested
  Clock* clock = nullptr;            ///< required; must outlive the executive, as must hooks and probe
  TickHooks* hooks = nullptr;
  const Probe* probe = nullptr;  ///< null: SystemProbe
  /// The number of late ticks that run back to back; further ones are skipped and reported.
  std::uint32_t catch_up_ticks = 4;
  RealtimeOptions realtime;  ///< not applied under a virtual clock
  AccountingOptions accounting;
  WatchdogOptions watchdog;  ///< off under a virtual clock
};

struct BaseBeat;
struct TaskSlot;
class Worker;

class Executive {
 public:
  /// Misuse (asserts): no clock, a base period below 1 ns, refused realtime options.
  explicit Executive(ExecutiveOptions options);
  ~Executive();
  Executive(const Executive&) = delete;
  Executive& operator=(const Executive&) = delete;

  /// Before run. `task` must outlive the executive. Misuse (asserts): a spec that why_refused() refuses; a
  /// second task of the same name.
  void add_task(TaskSpec spec, Task& task);

  /// Runs for the whole duration, or ends within one tick once `stop_requested` is true. Then waits for steps
  /// that are running on other threads and joins all threads that it created. Once per executive. The calling
  /// thread is the base thread and gets its scheduling policy back at the end. Throws std::system_error,
  /// before anything has run, when a thread can not be created.
  RunResult run(const std::atomic<bool>& stop_requested);

  /// The current state, without blocking the tick. After the last add_task().
  LiveSnapshot live() const;

 private:
  using Workers = std::vector<std::unique_ptr<Worker>>;
  Workers make_workers(std::vector<Worker*>& worker_of) const;
  void start_workers(const Workers& workers, RealtimeOutcome& outcome) const;

  SystemProbe system_probe_;
  TickHooks no_hooks_;
  ExecutiveOptions options_;  ///< with default hooks and probe filled in
  std::vector<std::unique_ptr<TaskSlot>> slots_;
  std::unique_ptr<BaseBeat> beat_;
  bool has_run_ = false;
};

}  // namespace hil::executive
