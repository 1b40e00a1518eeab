// A run reports what the machine refuses, and restores scheduler and affinity at its end. Refusals are
// provoked in a child process without rights.

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::ScriptedTask;
using test::spec_of;

bool contain(const std::vector<std::string>& sentences, const std::string& part) {
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const std::string& sentence) { return sentence.find(part) != std::string::npos; });
}

RunResult short_real_run(const RealtimeOptions& realtime) {
  test::ClockRun<MonotonicClock> real(20);
  real.options.realtime = realtime;
  ScriptedTask task;
  return real.run({{spec_of("threaded", 5, "threaded"), &task}});
}

/// Runs `check` in a child process without rights and returns its result.
template <typename Check>
bool holds_without_rights(Check check) {
  const pid_t child = fork();
  if (child == 0) {
    const rlimit none{0, 0};
    setrlimit(RLIMIT_RTPRIO, &none);
    const rlimit little{64 * 1024, 64 * 1024};
    setrlimit(RLIMIT_MEMLOCK, &little);
    if (getuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) _exit(3);
    _exit(check() ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(RealtimeOptions, OutOfRangeAreRefusedWithTheirValues) {
  RealtimeOptions options;
  EXPECT_FALSE(why_refused(options).has_value());
  options.scheduler = Scheduler::fifo;
  options.priority = 100;
  EXPECT_EQ(why_refused(options), "SCHED_FIFO priority 100; from 2 to 99");
  options.priority = 1;
  EXPECT_TRUE(why_refused(options).has_value()) << "the tasks' threads need a lower priority";
  options.priority = 50;
  options.cpus = {0, -1};
  EXPECT_EQ(why_refused(options), "CPU -1; from 0 to 1023");
}

TEST(RealtimeOptions, AtTheirDefaultsRequestNothing) {
  const RunResult result = short_real_run({});
  EXPECT_EQ(result.realtime.scheduler, Scheduler::other);
  EXPECT_FALSE(result.realtime.memory_locked);
  EXPECT_FALSE(contain(result.realtime.degraded, "refused"));
}

TEST(RealtimeOptions, RefusedByTheMachineAreReportedOnceAndTheRunContinues) {
  EXPECT_TRUE(holds_without_rights([] {
    RealtimeOptions realtime;
    realtime.scheduler = Scheduler::fifo;
    realtime.lock_memory = true;
    const RunResult result = short_real_run(realtime);
    const auto& degraded = result.realtime.degraded;
    for (const std::string& sentence : degraded)
      fprintf(stderr, "degraded: %s\n", sentence.c_str());
    const auto fifo_sentences =
        std::count(degraded.begin(), degraded.end(),
                   std::string("SCHED_FIFO refused (EPERM): give CAP_SYS_NICE or an rtprio limit"));
    return fifo_sentences == 1 &&
           contain(degraded, "memory is not locked (limit 64 KiB): give CAP_IPC_LOCK") &&
           result.realtime.scheduler == Scheduler::other && result.realtime.priority == 0 &&
           !result.realtime.memory_locked && result.run_time_ns == 20'000'000;
  }));
}

TEST(RealtimeOptions, WithAnUnknownCpuAreReported) {
  RealtimeOptions realtime;
  realtime.cpus = {1000};
  const RunResult result = short_real_run(realtime);
  EXPECT_TRUE(contain(result.realtime.degraded, "affinity to CPU 1000 refused (EINVAL)"));
  EXPECT_TRUE(result.realtime.cpus.empty());
}

TEST(RealtimeOptions, BindToCpusAndRestoreTheAffinity) {
  cpu_set_t before;
  sched_getaffinity(0, sizeof before, &before);
  int first = 0;
  while (!CPU_ISSET(static_cast<std::size_t>(first), &before))
    ++first;
  RealtimeOptions realtime;
  realtime.cpus = {first};
  test::ClockRun<MonotonicClock> real(10);
  real.options.realtime = realtime;
  std::atomic<bool> elsewhere{false};
  const auto note_cpu = [&](const TickInfo&) {
    if (sched_getcpu() != first) elsewhere = true;
  };
  ScriptedTask base(note_cpu), threaded(note_cpu);
  const RunResult result =
      real.run({{spec_of("base"), &base}, {spec_of("threaded", 1, "threaded"), &threaded}});
  EXPECT_EQ(result.realtime.cpus, realtime.cpus);
  EXPECT_FALSE(elsewhere);
  cpu_set_t after;
  sched_getaffinity(0, sizeof after, &after);
  EXPECT_TRUE(CPU_EQUAL(&before, &after));
}

TEST(RealtimeOptions, GiveRateMonotonicPrioritiesAndRestoreThePolicy) {
  test::ClockRun<MonotonicClock> real(20);
  real.options.realtime.scheduler = Scheduler::fifo;
  real.options.realtime.priority = 40;
  const auto priority_here = [] {
    sched_param parameters{};
    sched_getparam(0, &parameters);
    return parameters.sched_priority;
  };
  std::atomic<int> base_priority{0}, fast_priority{0}, slow_priority{0};
  ScriptedTask base([&](const TickInfo&) { base_priority = priority_here(); });
  ScriptedTask fast([&](const TickInfo&) { fast_priority = priority_here(); });
  ScriptedTask slow([&](const TickInfo&) { slow_priority = priority_here(); });
  const RunResult result = real.run(
      {{spec_of("slow", 10, "slow"), &slow}, {spec_of("fast", 2, "fast"), &fast}, {spec_of("base"), &base}});
  EXPECT_EQ(sched_getscheduler(0) & ~SCHED_RESET_ON_FORK, SCHED_OTHER)
      << "the policy of the caller is restored";
  if (result.realtime.scheduler == Scheduler::other) {
    EXPECT_TRUE(contain(result.realtime.degraded, "SCHED_FIFO refused"));
    EXPECT_EQ(base_priority, 0);
    return;
  }
  EXPECT_EQ(base_priority, 40);
  EXPECT_EQ(fast_priority, 39);
  EXPECT_EQ(slow_priority, 38);
}

}  // namespace
}  // namespace hil::executive
