#pragma once
// The executive: runs tasks at integer divisions of one base rate, in real time or under a virtual clock, and
// accounts for every run. Simulated time never lags real time silently: a tick that comes too late is run at
// once, up to `catch_up_ticks` in a row; beyond that ticks are given up and reported. Under the virtual clock
// nothing is ever late.
//
// One tick, on the base thread (the one that calls run):
//   begin hook (latch device inputs) -> publish what tasks on other threads have due -> tasks in the order
//   they were added (base thread's tasks: latch, step, publish; others: latch, wake their thread) -> end hook
//   (release device outputs)
//
// Two kinds of trouble are kept apart. Deadline miss: a run finished after its deadline. Overrun: a run was
// still going on when its next release arrived. Slack is deadline - response time: positive is good.
//
// Threads: one thread configures and runs; live() may be called from any thread while run() goes on.

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

/// What surrounds the tasks of each tick, on the base thread. `tick.run` is the number of ticks that ran
/// before.
class TickHooks {
 public:
  virtual ~TickHooks() = default;
  /// Once, before the first tick: run time 0 is `start_ns` on the clock, at most a period ahead.
  virtual void before_first_tick(std::int64_t start_ns) noexcept { (void)start_ns; }
  virtual void begin_tick(const TickInfo& tick) noexcept { (void)tick; }
  virtual void end_tick(const TickInfo& tick) noexcept { (void)tick; }
};

struct ExecutiveOptions {
  std::int64_t base_period_ns = 1'000'000;
  std::uint64_t duration_ticks = 0;  ///< 0: until a stop is asked for
  Clock* clock = nullptr;            ///< needed; lives longer than the executive, as do hooks and probe
  TickHooks* hooks = nullptr;
  const Probe* probe = nullptr;  ///< null: the system's
  /// Ticks that are run back to back when real time has run ahead; when more are due, they are skipped and
  /// reported.
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

  /// Before run. Misuse (asserts): a spec that why_refused() refuses, or a second task of the same name.
  /// `task` lives longer than the executive.
  void add_task(TaskSpec spec, Task& task);

  /// Runs to the end of the duration, or ends in order within one tick once `stop_requested` is true: then
  /// waits for steps under way on other threads and joins all threads it made. Once per executive. The
  /// calling thread becomes the base thread and gets its scheduling back at the end. May throw
  /// std::system_error when a thread can not be made; nothing has run then.
  RunResult run(const std::atomic<bool>& stop_requested);

  /// The state right now; takes nothing from the tick. After the last add_task().
  LiveSnapshot live() const;

 private:
  using Workers = std::vector<std::unique_ptr<Worker>>;
  Workers make_workers(std::vector<Worker*>& worker_of) const;
  void start_workers(const Workers& workers, RealtimeOutcome& outcome) const;

  SystemProbe system_probe_;
  TickHooks no_hooks_;
  ExecutiveOptions options_;  ///< with hooks and probe filled in
  std::vector<std::unique_ptr<TaskSlot>> slots_;
  std::unique_ptr<BaseBeat> beat_;
  bool has_run_ = false;
};

}  // namespace hil::executive
