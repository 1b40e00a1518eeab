// A real pause of a process: a child runs an executive, the test stops it with SIGSTOP and continues it 1.5 s
// later. The test sleeps, since the length of the pause in real time is the subject.

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

using test::ScriptedTask;
using test::spec_of;
constexpr std::int64_t ms = 1'000'000;

/// The child process: 4 s at 1 kHz. Returns 0 when the longest skip has the pause's length, its cause is
/// host_pause, and no hang was detected.
int run_in_child(int started_pipe) {
  test::ClockRun<MonotonicClock> run(4000);
  run.options.watchdog.timeout_ns = 1000 * ms;
  std::atomic<bool> safe{false};
  run.options.watchdog.safe_state = [&] { safe = true; };
  bool signalled = false;  // any single tick may be skipped
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.tick >= 100 && !std::exchange(signalled, true)) (void)!write(started_pipe, "x", 1);
  });
  ScriptedTask threaded;
  const RunResult result = run.run({{spec_of("t"), &task}, {spec_of("threaded", 10, "threaded"), &threaded}});
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

TEST(HostPause, OfAStoppedProcessIsACauseAndNoHang) {
  int started_pipe[2];
  ASSERT_EQ(pipe(started_pipe), 0);
  const pid_t child = fork();
  if (child == 0) _exit(run_in_child(started_pipe[1]));
  close(started_pipe[1]);
  char started = 0;
  ASSERT_EQ(read(started_pipe[0], &started, 1), 1) << "the child did not reach tick 100";
  kill(child, SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  kill(child, SIGCONT);
  int status = 0;
  waitpid(child, &status, 0);
  close(started_pipe[0]);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace hil::executive
