#pragma once
// Executives of tests. A FakeClock stands still unless a thread sleeps on it or the test advances it; it is
// not a virtual clock, so ticks can be late on it. A FakeProbe reports the values that the test sets.

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <string>
#include <thread>
#include <utility>

#include "runtime/executive/clock.hpp"
#include "runtime/executive/executive.hpp"
#include "runtime/executive/probe.hpp"

namespace hil::executive::test {

class FakeClock final : public Clock {
 public:
  std::int64_t now_ns() const noexcept override { return now_ns_.load(); }
  void sleep_until(std::int64_t wake_ns) noexcept override {
    if (wake_ns > now_ns()) now_ns_.store(wake_ns + (oversleep_ns ? oversleep_ns(wake_ns) : 0));
  }
  bool is_virtual() const noexcept override { return false; }
  void advance(std::int64_t by_ns) noexcept { now_ns_.fetch_add(by_ns); }

  /// How much too late a sleep until the given instant ends.
  std::function<std::int64_t(std::int64_t wake_ns)> oversleep_ns;

 private:
  std::atomic<std::int64_t> now_ns_{1'000'000'000};
};

class FakeProbe final : public Probe {
 public:
  std::int64_t thread_cpu_ns() const noexcept override { return cpu_ns.load(); }
  PageFaults thread_faults() const noexcept override { return {minor_faults.load(), major_faults.load()}; }
  std::int64_t host_now_ns() const noexcept override {
    ++host_time_readings;
    return host_ns.load();
  }
  std::int64_t process_cpu_ns() const noexcept override { return process_ns.load(); }
  std::int64_t host_steal_ns() const noexcept override {
    ++steal_readings;
    return steal_ns.load();
  }

  std::atomic<std::int64_t> cpu_ns{0};
  std::atomic<std::int64_t> minor_faults{0};
  std::atomic<std::int64_t> major_faults{0};
  std::atomic<std::int64_t> host_ns{0};
  std::atomic<std::int64_t> process_ns{0};
  std::atomic<std::int64_t> steal_ns{0};
  mutable std::atomic<int> steal_readings{0};
  mutable std::atomic<int> host_time_readings{0};
};

/// A task made of functions; those not given do nothing.
class ScriptedTask final : public Task {
 public:
  using Action = std::function<void(const TickInfo&)>;
  ScriptedTask() = default;
  explicit ScriptedTask(Action step_action) : on_step(std::move(step_action)) {}

  void latch(const TickInfo& tick) noexcept override { call(on_latch, tick); }
  void step(const TickInfo& tick) noexcept override { call(on_step, tick); }
  void publish(const TickInfo& tick) noexcept override { call(on_publish, tick); }
  void queue(const TickInfo& tick) noexcept override { call(on_queue, tick); }
  void abort() noexcept override {
    if (on_abort) on_abort();
  }
  std::int64_t last_blocked_ns() const noexcept override { return blocked_ns; }
  std::int64_t last_gpu_ns() const noexcept override { return gpu_ns; }

  Action on_latch, on_step, on_publish, on_queue;
  std::function<void()> on_abort;
  std::int64_t blocked_ns = 0;
  std::int64_t gpu_ns = 0;

 private:
  static void call(const Action& action, const TickInfo& tick) {
    if (action) action(tick);
  }
};

class ScriptedHooks final : public TickHooks {
 public:
  void begin_tick(const TickInfo& tick) noexcept override {
    if (on_begin) on_begin(tick);
  }
  void end_tick(const TickInfo& tick) noexcept override {
    if (on_end) on_end(tick);
  }
  std::function<void(const TickInfo&)> on_begin, on_end;
};

using Tasks = std::initializer_list<std::pair<TaskSpec, Task*>>;

/// Runs an executive with these tasks to its end.
inline RunResult run_tasks(const ExecutiveOptions& options, Tasks tasks, const std::atomic<bool>& stop) {
  Executive executive(options);
  for (const auto& [spec, task] : tasks)
    executive.add_task(spec, *task);
  return executive.run(stop);
}

/// A run of 1 ms ticks on a clock that the test does not control.
template <typename ClockType>
struct ClockRun {
  ClockType clock;
  ExecutiveOptions options;
  std::atomic<bool> stop{false};

  explicit ClockRun(std::uint64_t duration_ticks) {
    options.clock = &clock;
    options.duration_ticks = duration_ticks;
  }
  RunResult run(Tasks tasks) { return run_tasks(options, tasks, stop); }
};

/// A run of 1 ms ticks on fake time.
struct FakeRun {
  FakeClock clock;
  FakeProbe probe;
  ScriptedHooks hooks;
  ExecutiveOptions options;
  std::atomic<bool> stop{false};

  explicit FakeRun(std::uint64_t duration_ticks) {
    options.base_period_ns = 1'000'000;
    options.duration_ticks = duration_ticks;
    options.clock = &clock;
    options.probe = &probe;
    options.hooks = &hooks;
    options.watchdog.timeout_ns = 60'000'000'000;
  }
  RunResult run(Tasks tasks) { return run_tasks(options, tasks, stop); }
  /// Computes for that long: the clock and the thread's CPU time advance.
  void work(std::int64_t for_ns) {
    probe.cpu_ns += for_ns;
    clock.advance(for_ns);
  }
};

inline TaskSpec spec_of(const char* name, std::uint32_t every_ticks = 1, const char* thread = "") {
  TaskSpec spec;
  spec.name = std::string(name);
  spec.every_ticks = every_ticks;
  spec.thread = std::string(thread);
  return spec;
}

/// Waits until a thread of this process sleeps. Three readings in a row, since a running thread may sleep for
/// a moment on its way.
inline void wait_until_thread_sleeps(pid_t thread) {
  for (int asleep = 0; asleep < 3; ++asleep) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::ifstream stat("/proc/self/task/" + std::to_string(thread) + "/stat");
    const std::string text{std::istreambuf_iterator<char>(stat), {}};
    const std::size_t name_end = text.rfind(')');  // the state follows the name
    if (name_end == std::string::npos || text[name_end + 2] != 'S') asleep = -1;
  }
}

}  // namespace hil::executive::test
