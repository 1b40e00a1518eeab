// A real pause: a child process runs an executive, is stopped with SIGSTOP for a while and continued, and
// must name what happened to it.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <thread>
#include <utility>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using testing::ScriptedTask;
using testing::spec_of;
constexpr std::int64_t ms = 1'000'000;

/// The child: 4 s at 1 kHz. 0 when the longest skip is long enough and named host_pause and no hang was
/// seen.
int run_and_judge(int beat_pipe) {
  MonotonicClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  options.duration_ticks = 4000;
  options.watchdog.timeout_ns = 1000 * ms;
  std::atomic<bool> safe{false};
  options.watchdog.safe_state = [&] { safe = true; };
  bool signalled = false;  // a busy machine may skip any one tick
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.tick >= 100 && !std::exchange(signalled, true)) (void)!write(beat_pipe, "x", 1);
  });
  ScriptedTask own;
  Executive executive(options);
  executive.add_task(spec_of("t"), task);
  executive.add_task(spec_of("own", 10, "own"), own);
  const std::atomic<bool> stop{false};
  const RunResult result = executive.run(stop);
  Skip longest;
  for (const Skip& skip : result.base.skips) {
    if (skip.count > longest.count) longest = skip;
  }
  std::fprintf(stderr, "skipped %llu ticks at tick %llu: %s\n",
               static_cast<unsigned long long>(longest.count), static_cast<unsigned long long>(longest.tick),
               to_string(longest.cause));
  if (longest.count < 1450) return 1;
  if (longest.cause != MissCause::host_pause) return 2;
  if (result.run_time_ns != 4000 * ms) return 3;
  if (result.tasks[0].skipped < longest.count) return 4;
  if (result.hang.has_value() || safe) return 5;
  return 0;
}

TEST(HostPause, AStoppedProcessIsNamedAsSuchAndIsNoHang) {
  int beat_pipe[2];
  ASSERT_EQ(pipe(beat_pipe), 0);
  const pid_t child = fork();
  if (child == 0) _exit(run_and_judge(beat_pipe[1]));
  close(beat_pipe[1]);
  char beat = 0;
  ASSERT_EQ(read(beat_pipe[0], &beat, 1), 1) << "the child did not get to tick 100";
  kill(child, SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  kill(child, SIGCONT);
  int status = 0;
  waitpid(child, &status, 0);
  close(beat_pipe[0]);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace hil::executive
