// A process that is stopped and continued publishes no firm transaction late and reports no false miss.

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <thread>

#include "rtstdb/transaction/monotonic_clock.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/simulation/engine.hpp"

namespace hil::long_test {
namespace {

using namespace std::chrono_literals;
using namespace rtstdb;
using namespace rtstdb::transaction::test;

struct Results {
  std::uint64_t committed = 0, missed = 0, late_commits = 0, false_misses = 0;
  Nanoseconds max_pause{0}, max_lateness{0};
};

bool is_closed(int pipe_end) {
  pollfd polled{.fd = pipe_end, .events = 0, .revents = 0};
  return poll(&polled, 1, 0) != 0;
}

/// Executes a firm transaction about every millisecond until the test closes its end of the pipe `until`.
Results run_process(int until, int ready) {
  const transaction::MonotonicClock clock;
  SimulatedExecutor executor;
  executor.work = [&](const auto&, const auto&, const auto&) {
    const ClockTime end = clock.now() + 50us;
    while (clock.now() < end) {
    }
    return query::RunReport{};
  };
  transaction::Engine engine(engine_options(), executor, clock);
  SimulatedQuery query(4);
  const auto transaction = engine.make_transaction({.max_writes = 1, .max_queries = 1});
  transaction->begin({});
  const auto ordinal = transaction->create(row_of(1));
  engine.submit(*transaction);
  engine.wait(*transaction);
  const EntityId entity = transaction->created(ordinal);
  Results results;
  close(ready);
  ClockTime last = clock.now();
  while (!is_closed(until)) {
    const ClockTime deadline = clock.now() + 20ms;
    transaction->begin(terms(DeadlineClass::firm, deadline));
    transaction->update(entity, row_of(2));
    transaction->add_query(query, 4);
    engine.submit(*transaction);
    const Outcome& outcome = engine.wait(*transaction);
    const ClockTime now = clock.now();
    const bool missed = outcome.status == Status::missed;
    results.committed += outcome.done();
    results.missed += missed;
    results.late_commits += outcome.done() && outcome.published > deadline;
    results.false_misses += missed && (outcome.lateness <= 0ns || now - deadline < outcome.lateness);
    results.max_lateness = std::max(results.max_lateness, outcome.lateness);
    results.max_pause = std::max(results.max_pause, now - last);
    last = now;
    std::this_thread::sleep_for(1ms);
  }
  results.late_commits += engine.counts().firm_late_commits;
  return results;
}

TEST(PausedProcess, HasNoLateCommitAndNoFalseMiss) {
  int until[2] = {}, ready[2] = {}, output[2] = {};
  for (int* const ends : {until, ready, output})
    ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    close(until[1]);
    const Results results = run_process(until[0], ready[1]);
    _exit(write(output[1], &results, sizeof results) == sizeof results ? 0 : 1);
  }
  close(ready[1]);
  close(output[1]);
  char byte = 0;
  EXPECT_EQ(read(ready[0], &byte, 1), 0) << "the process closes its end when it runs";
  // The pauses are real time, which is the subject.
  const int pauses = static_cast<int>(tests::rounds(6, 200));
  for (int k = 0; k < pauses; ++k) {
    std::this_thread::sleep_for(
        std::chrono::microseconds(20'000 + 137 * k));  // in any state of a transaction
    ASSERT_EQ(kill(child, SIGSTOP), 0);
    int state = 0;
    ASSERT_EQ(waitpid(child, &state, WUNTRACED), child);
    ASSERT_TRUE(WIFSTOPPED(state));
    std::this_thread::sleep_for(150ms);  // the length of the pause
    ASSERT_EQ(kill(child, SIGCONT), 0);
  }
  std::this_thread::sleep_for(100ms);  // so that the process notes the last pause
  close(until[1]);
  Results results;
  ASSERT_EQ(read(output[0], &results, sizeof results), static_cast<ssize_t>(sizeof results));
  int state = 0;
  waitpid(child, &state, 0);
  EXPECT_TRUE(WIFEXITED(state) && WEXITSTATUS(state) == 0);
  for (const int end : {until[0], ready[0], output[0]})
    close(end);
  std::cout << results.committed << " committed, " << results.missed << " missed, longest pause "
            << results.max_pause / 1ms << " ms\n";
  EXPECT_EQ(results.late_commits, 0u);
  EXPECT_EQ(results.false_misses, 0u);
  EXPECT_GT(results.committed, 0u);
  EXPECT_GE(results.max_pause, 150ms);
  EXPECT_LE(results.max_lateness, results.max_pause);
}

}  // namespace
}  // namespace hil::long_test
